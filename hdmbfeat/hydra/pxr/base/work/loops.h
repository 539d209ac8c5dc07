#pragma once
#include "pxr/work/loops.h" // IWYU pragma: export
