#pragma once
#include "pxr/gf/rotation.h" // IWYU pragma: export
