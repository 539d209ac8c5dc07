#pragma once
#include "pxr/arch/timing.h" // IWYU pragma: export
