#pragma once
#include "pxr/vt/traits.h" // IWYU pragma: export
