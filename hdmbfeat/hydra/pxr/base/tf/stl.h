#pragma once
#include "pxr/tf/stl.h" // IWYU pragma: export
