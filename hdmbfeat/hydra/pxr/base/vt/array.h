#pragma once
#include "pxr/vt/array.h" // IWYU pragma: export
