#pragma once
#include "pxr/tf/notice.h" // IWYU pragma: export
