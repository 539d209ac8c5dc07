#pragma once
#include "pxr/tf/stopwatch.h" // IWYU pragma: export
