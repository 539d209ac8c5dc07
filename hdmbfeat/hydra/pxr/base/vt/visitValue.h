#pragma once
#include "pxr/vt/visitValue.h" // IWYU pragma: export
