#pragma once
#include "pxr/tf/envSetting.h" // IWYU pragma: export
