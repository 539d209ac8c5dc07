#pragma once
#include "pxr/gf/rect2i.h" // IWYU pragma: export
