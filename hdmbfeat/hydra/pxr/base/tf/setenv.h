#pragma once
#include "pxr/tf/setenv.h" // IWYU pragma: export
