#pragma once
#include "pxr/arch/hints.h" // IWYU pragma: export
