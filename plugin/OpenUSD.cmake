# Finds the OpenUSD to build the plug-in against and makes the target mbfeat_usd for it.
#
# Two kinds serve, looked for under MBFEAT_USD_ROOT:
#   SDK      a full OpenUSD installation (pxrConfig.cmake); the real Hydra headers are used and
#            hdmbfeat/hydra is not on the include path. Without MBFEAT_USD_ROOT, the places that
#            find_package searches by itself are tried.
#   runtime  the prefix that ./run assembles: lib/libusd_ms.so, and the headers of the base
#            libraries under include/; the Hydra declarations come from hdmbfeat/hydra.
#
# Sets MBFEAT_USD_KIND to SDK, RUNTIME, or NONE, and when NONE MBFEAT_USD_WHY to one sentence.
set(MBFEAT_USD_KIND NONE)

if(MBFEAT_USD_ROOT AND EXISTS "${MBFEAT_USD_ROOT}/lib/libusd_ms.so"
   AND NOT EXISTS "${MBFEAT_USD_ROOT}/pxrConfig.cmake")
    if(NOT EXISTS "${MBFEAT_USD_ROOT}/include/pxr/tf/token.h")
        set(MBFEAT_USD_WHY "${MBFEAT_USD_ROOT} has libusd_ms.so but no headers in include/pxr")
        return()
    endif()
    if(NOT TARGET Python::Module)
        set(MBFEAT_USD_WHY "the headers of CPython 3.11 are missing (Debian: python3-dev)")
        return()
    endif()
    set(MBFEAT_USD_KIND RUNTIME)
    add_library(mbfeat_usd INTERFACE)
    target_include_directories(mbfeat_usd INTERFACE "${PROJECT_SOURCE_DIR}/hdmbfeat/hydra")
    target_include_directories(mbfeat_usd SYSTEM INTERFACE "${MBFEAT_USD_ROOT}/include")
    # The base headers open one internal namespace, the runtime was built with another.
    # PXR_PYTHON_SUPPORT_ENABLED must hold in every file, as it did in the runtime.
    target_compile_definitions(mbfeat_usd INTERFACE
        pxrInternal_v0_25_8__pxrReserved__=pxrBlender_v25_08__pxrReserved__
        PXR_PYTHON_SUPPORT_ENABLED
        MFB_PACKAGE_NAME=hdMBFeat MFB_ALT_PACKAGE_NAME=hdMBFeat MFB_PACKAGE_MODULE=HdMBFeat)
    target_link_libraries(mbfeat_usd INTERFACE
        Python::Module "${MBFEAT_USD_ROOT}/lib/libusd_ms.so" TBB::tbb)
    # The base headers include <ext/hash_set>, which warns with #warning whoever includes it.
    target_compile_options(mbfeat_usd INTERFACE -Wno-cpp)
    # libusd_ms leaves Python's symbols, and some drivers', to the process that loads it.
    target_link_options(mbfeat_usd INTERFACE -Wl,--allow-shlib-undefined)
    return()
endif()

if(MBFEAT_USD_ROOT)
    find_package(pxr CONFIG QUIET PATHS "${MBFEAT_USD_ROOT}" NO_DEFAULT_PATH)
else()
    find_package(pxr CONFIG QUIET)
endif()
if(NOT pxr_FOUND)
    if(MBFEAT_USD_ROOT)
        set(MBFEAT_USD_WHY "MBFEAT_USD_ROOT=${MBFEAT_USD_ROOT} holds neither lib/libusd_ms.so nor pxrConfig.cmake")
    else()
        set(MBFEAT_USD_WHY "MBFEAT_USD_ROOT is not set and no OpenUSD SDK was found")
    endif()
    return()
endif()
if(NOT TARGET hd)
    set(MBFEAT_USD_WHY "the OpenUSD SDK in ${pxr_DIR} was built without imaging")
    return()
endif()
set(MBFEAT_USD_KIND SDK)
add_library(mbfeat_usd INTERFACE)
target_include_directories(mbfeat_usd SYSTEM INTERFACE ${PXR_INCLUDE_DIRS})
target_compile_definitions(mbfeat_usd INTERFACE
    MFB_PACKAGE_NAME=hdMBFeat MFB_ALT_PACKAGE_NAME=hdMBFeat MFB_PACKAGE_MODULE=HdMBFeat)
target_compile_options(mbfeat_usd INTERFACE -Wno-cpp)
target_link_libraries(mbfeat_usd INTERFACE hd hdsi hf hio usdImaging cameraUtil TBB::tbb)
