#pragma once
#include "pxr/gf/traits.h" // IWYU pragma: export
