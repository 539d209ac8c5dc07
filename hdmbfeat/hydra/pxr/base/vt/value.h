#pragma once
#include "pxr/vt/value.h" // IWYU pragma: export
