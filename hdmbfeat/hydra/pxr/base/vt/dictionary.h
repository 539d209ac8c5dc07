#pragma once
#include "pxr/vt/dictionary.h" // IWYU pragma: export
