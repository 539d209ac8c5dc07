#pragma once

#include "pxr/imaging/interface.h"

#include <memory>

HYDRA_INTERFACE_OPEN_SCOPE

/// Passed through, never looked into: HdUtils builds containers and the library reads them.
class HdDataSourceBase;
class HdContainerDataSource;
using HdDataSourceBaseHandle = std::shared_ptr<HdDataSourceBase>;
using HdContainerDataSourceHandle = std::shared_ptr<HdContainerDataSource>;

HYDRA_INTERFACE_CLOSE_SCOPE
