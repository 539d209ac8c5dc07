#pragma once
#include "pxr/js/utils.h" // IWYU pragma: export
