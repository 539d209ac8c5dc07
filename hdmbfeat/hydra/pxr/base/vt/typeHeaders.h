#pragma once
#include "pxr/vt/typeHeaders.h" // IWYU pragma: export
