#pragma once
#include "pxr/work/utils.h" // IWYU pragma: export
