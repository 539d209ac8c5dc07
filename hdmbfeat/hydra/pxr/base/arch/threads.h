#pragma once
#include "pxr/arch/threads.h" // IWYU pragma: export
