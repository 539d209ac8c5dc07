#pragma once
#include "pxr/vt/hash.h" // IWYU pragma: export
