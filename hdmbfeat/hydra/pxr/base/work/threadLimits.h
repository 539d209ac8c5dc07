#pragma once
#include "pxr/work/threadLimits.h" // IWYU pragma: export
