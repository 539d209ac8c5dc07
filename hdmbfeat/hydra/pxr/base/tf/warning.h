#pragma once
#include "pxr/tf/warning.h" // IWYU pragma: export
