#pragma once
#include "pxr/tf/diagnostic.h" // IWYU pragma: export
