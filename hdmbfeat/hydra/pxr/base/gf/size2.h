#pragma once
#include "pxr/gf/size2.h" // IWYU pragma: export
