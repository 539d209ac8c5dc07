#pragma once
#include "pxr/tf/mallocTag.h" // IWYU pragma: export
