// Writing the pixels of product files. Internal to film/; the functions throw what OpenEXR throws.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <ImfIO.h>

#include "film/product.h"

namespace mbfeat {

/// A file stream that knows whether everything reached the system. OpenEXR's own swallows errors
/// of the writes in its destructors, among them the table without which a file cannot be read.
class CheckedFileStream : public Imf::OStream {
public:
    /// Creates the file; throws where that is not possible.
    explicit CheckedFileStream(const std::string& path);

    void write(const char bytes[], int count) override;
    std::uint64_t tellp() override;
    void seekp(std::uint64_t position) override;

    /// Closes the file; throws the first error of its life.
    void close();

private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    void fail();

    std::unique_ptr<std::FILE, Close> file_;
    int error_ = 0; ///< errno of the first failure
};

/// Writes a raster product. Returns how many values a half could not hold.
std::uint64_t writeRaster(Imf::OStream& stream, const ProductSpec& product, const Film& film,
                          const RenderReport& report, int threads);

/// Writes a deep product; the film keeps its paths.
void writeDeep(Imf::OStream& stream, const ProductSpec& product, const Film& film,
               const RenderReport& report, int threads);

} // namespace mbfeat
