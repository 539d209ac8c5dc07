#pragma once
#include "pxr/gf/quath.h" // IWYU pragma: export
