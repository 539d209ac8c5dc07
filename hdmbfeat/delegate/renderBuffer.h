// AOV buffers that hosts bind and read.
#pragma once

#include "pxr/pxr.h"

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "core/diagnostics.h"
#include "pxr/imaging/hd/renderBuffer.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// Pixels in memory, bottom row first. Render threads never touch it: the render pass copies the
/// film into it on the application's thread, so a buffer may die at any time. Readers map it.
class RenderBuffer final : public HdRenderBuffer {
public:
    RenderBuffer(const SdfPath& id, Diagnostics& diagnostics);
    ~RenderBuffer() override;

    /// False, with a message where memory is short, leaves an empty buffer of no size.
    bool Allocate(const GfVec3i& dimensions, HdFormat format, bool multiSampled) override;
    unsigned int GetWidth() const override { return width_; }
    unsigned int GetHeight() const override { return height_; }
    unsigned int GetDepth() const override { return 1; }
    HdFormat GetFormat() const override { return format_; }
    bool IsMultiSampled() const override { return false; }
    void* Map() override;
    void Unmap() override;
    bool IsMapped() const override { return mappers_ > 0; }
    void Resolve() override {}
    bool IsConverged() const override { return converged_; }
    void setConverged(bool converged) { converged_ = converged; }

    /// Says what the pixels hold, so that a copy is made only of something new. 0: nothing yet.
    std::uint64_t stamp() const { return stamp_; }
    void setStamp(std::uint64_t stamp) { stamp_ = stamp; }

    /// Writes pixels from rows of `channels` floats each, row 0 on top, converting to the buffer's
    /// format. Components that the source lacks become 0, or 1 for a fourth one. The rectangle
    /// (x, y down from the top left) is clipped to the buffer.
    void write(const float* pixels, int channels, int x, int y, int width, int height);
    /// The same for integers, which integer formats keep exactly.
    void write(const std::int32_t* pixels, int x, int y, int width, int height);
    /// Sets every pixel to one value, in up to four components.
    void fill(const float (&value)[4]);

protected:
    void _Deallocate() override;

private:
    template <class Source>
    void writeRows(const Source& source, int x, int y, int width, int height);

    Diagnostics messages_; ///< of the last allocation
    std::mutex mutex_;
    std::vector<std::uint8_t> data_;
    unsigned int width_ = 0, height_ = 0;
    HdFormat format_ = HdFormatInvalid;
    std::atomic<int> mappers_{0};
    std::atomic<bool> converged_{false};
    std::uint64_t stamp_ = 0;
};

} // namespace mbfeat
