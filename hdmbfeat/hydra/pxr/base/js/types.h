#pragma once
#include "pxr/js/types.h" // IWYU pragma: export
