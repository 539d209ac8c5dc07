#pragma once
#include "pxr/gf/transform.h" // IWYU pragma: export
