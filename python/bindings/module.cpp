// The Python module mbfeat._core: the renderer's tables, the host exchange, films and files.
#include "bindings.h"

NB_MODULE(_core, module) {
    module.doc() = "The renderer's tables, the host exchange, films and files. The typed face of "
                   "this module is the package mbfeat.";
    [[maybe_unused]] const nanobind::exception<mbfeat::BindingError> error(module, "Error",
                                                                           PyExc_RuntimeError);
    mbfeat::bindSettings(module);
    mbfeat::bindAovs(module);
    mbfeat::bindFilm(module);
    mbfeat::bindProducts(module);
    mbfeat::bindHost(module);
    mbfeat::bindColor(module);
    mbfeat::bindDenoise(module);
}
