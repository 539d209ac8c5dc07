#pragma once
#include "pxr/tf/api.h" // IWYU pragma: export
