#pragma once
#include "pxr/gf/size3.h" // IWYU pragma: export
