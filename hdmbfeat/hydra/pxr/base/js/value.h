#pragma once
#include "pxr/js/value.h" // IWYU pragma: export
