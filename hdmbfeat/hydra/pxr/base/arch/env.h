#pragma once
#include "pxr/arch/env.h" // IWYU pragma: export
