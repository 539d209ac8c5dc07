#pragma once
#include "pxr/arch/hash.h" // IWYU pragma: export
