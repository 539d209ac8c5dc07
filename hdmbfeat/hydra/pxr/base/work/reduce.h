#pragma once
#include "pxr/work/reduce.h" // IWYU pragma: export
