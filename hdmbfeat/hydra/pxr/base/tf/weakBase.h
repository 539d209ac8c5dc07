#pragma once
#include "pxr/tf/weakBase.h" // IWYU pragma: export
