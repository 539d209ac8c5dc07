#pragma once
#include "pxr/arch/defines.h" // IWYU pragma: export
