#pragma once
#include "pxr/vt/types.h" // IWYU pragma: export
