#pragma once
#include "pxr/tf/weakPtr.h" // IWYU pragma: export
