// Layouts of files on disk, and whether they are what the AOV table says.
#include <algorithm>
#include <exception>
#include <map>
#include <tuple>

#include <ImfChannelList.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include "film/exrHeader.h"
#include "film/exrLayout.h"

namespace mbfeat {

namespace {

PixelType pixelTypeOf(Imf::PixelType type) {
    return type == Imf::HALF    ? PixelType::kHalf
           : type == Imf::FLOAT ? PixelType::kFloat
                                : PixelType::kUInt;
}

std::string layerOf(const std::string& channel) {
    const std::size_t dot = channel.rfind('.');
    // validMask is a channel of its own, not one of the unnamed layer.
    return dot != std::string::npos ? channel.substr(0, dot)
           : channel == "validMask" ? channel
                                    : "color";
}

std::string suffixOf(const std::string& channel) {
    return channel.substr(channel.rfind('.') + 1);
}

/// The AOV that a layer holds: what the header says, else what its name says.
std::string aovOf(const Imf::Header& header, const std::string& layer) {
    const auto* const attribute =
        header.findTypedAttribute<Imf::StringAttribute>(layerAttributeName(layer));
    const std::string name = attribute != nullptr ? attribute->value() : layer;
    return findAov(name) ? name : std::string();
}

/// Channels in the AOV's order; those it does not have last.
void sortChannels(AovLayoutEntry& entry, const std::vector<std::string>& order) {
    const auto place = [&](const std::string& channel) {
        return std::find(order.begin(), order.end(), suffixOf(channel)) - order.begin();
    };
    std::stable_sort(
        entry.channels.begin(), entry.channels.end(),
        [&](const std::string& a, const std::string& b) { return place(a) < place(b); });
}

std::vector<AovLayoutEntry> layersOf(const Imf::Header& header, int part) {
    std::map<std::string, AovLayoutEntry> byName;
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
        const PixelType type = pixelTypeOf(channel.channel().type);
        AovLayoutEntry& entry = byName[layerOf(channel.name())];
        const bool isFirst = entry.channels.empty();
        entry.type = isFirst || entry.type == pixelTypeName(type) ? pixelTypeName(type) : "mixed";
        entry.channels.emplace_back(channel.name());
        entry.bytes += pixelTypeBytes(type);
    }
    std::vector<AovLayoutEntry> layers;
    for (auto& [name, entry] : byName) {
        entry.layer = name;
        entry.aov = aovOf(header, name);
        entry.part = part;
        if (const std::optional<AovDescriptor> aov = findAov(entry.aov)) {
            entry.vertex = aov->vertex;
            entry.doc = aov->doc;
            sortChannels(entry, aov->channels);
        }
        layers.push_back(std::move(entry));
    }
    return layers;
}

/// Gives layers of a deep file that are fields of a path, not AOVs, their meaning and order.
void describeDeepLayers(std::vector<AovLayoutEntry>& layers) {
    for (const AovLayoutEntry& known : deepLayers(true)) {
        for (AovLayoutEntry& layer : layers) {
            if (layer.layer == known.layer && known.aov.empty()) {
                layer.aov.clear();
                layer.doc = known.doc;
                sortChannels(layer, {"R", "G", "B", "A", "Z", "X", "Y"});
            }
        }
    }
}

/// Place in the AOV table; AOVs outside of it (primvars) follow, then what is not ours.
std::size_t tablePlace(const AovLayoutEntry& entry) {
    const std::vector<AovDescriptor>& table = aovTable();
    const auto found = std::find_if(table.begin(), table.end(), [&](const AovDescriptor& aov) {
        return aov.name == entry.aov;
    });
    return static_cast<std::size_t>(found - table.begin()) +
           (found == table.end() && entry.aov.empty() ? 1U : 0U);
}

std::size_t deepPlace(const AovLayoutEntry& entry) {
    const std::vector<AovLayoutEntry> known = deepLayers(true);
    return static_cast<std::size_t>(
        std::find_if(known.begin(), known.end(),
                     [&](const AovLayoutEntry& layer) { return layer.layer == entry.layer; }) -
        known.begin());
}

void sortLayers(AovLayout& layout) {
    std::stable_sort(layout.layers.begin(), layout.layers.end(),
                     [&](const AovLayoutEntry& a, const AovLayoutEntry& b) {
                         const auto place = [&](const AovLayoutEntry& entry) {
                             return std::make_tuple(
                                 entry.part, layout.deep ? deepPlace(entry) : tablePlace(entry),
                                 entry.layer);
                         };
                         return place(a) < place(b);
                     });
}

ImageWindow windowOf(const Imf::Header& header) {
    const Imath::Box2i& display = header.displayWindow();
    const Imath::Box2i& data = header.dataWindow();
    ImageWindow window;
    window.width = display.max.x - display.min.x + 1;
    window.height = display.max.y - display.min.y + 1;
    window.data = {data.min.x, data.min.y, data.max.x - data.min.x + 1,
                   data.max.y - data.min.y + 1};
    window.pixelAspectRatio = header.pixelAspectRatio();
    return window;
}

AovLayout readLayout(const Imf::MultiPartInputFile& file) {
    AovLayout layout;
    layout.parts = file.parts();
    const Imf::Header& first = file.header(0);
    layout.deep = first.hasType() && Imf::isDeepData(first.type());
    layout.window = windowOf(first);
    layout.compression = exrCompressionName(first.compression());
    for (auto attribute = first.begin(); attribute != first.end(); ++attribute) {
        if (const auto* const text =
                dynamic_cast<const Imf::StringAttribute*>(&attribute.attribute())) {
            layout.attributes.emplace_back(attribute.name(), text->value());
        }
    }
    for (int part = 0; part < file.parts(); ++part) {
        std::vector<AovLayoutEntry> layers = layersOf(file.header(part), part);
        layout.layers.insert(layout.layers.end(), layers.begin(), layers.end());
    }
    if (layout.deep) {
        describeDeepLayers(layout.layers);
    }
    sortLayers(layout);
    return layout;
}

std::string quotedList(const std::vector<std::string>& names) {
    std::string list;
    for (const std::string& name : names) {
        list += (list.empty() ? "" : ", ") + name;
    }
    return list.empty() ? "none" : list;
}

/// A layer of a raster file against its AOV.
void checkLayer(const AovLayoutEntry& layer, std::vector<std::string>& differences) {
    const std::optional<AovDescriptor> aov = findAov(layer.aov);
    if (!aov) {
        differences.push_back("Layer '" + layer.layer + "' (" + quotedList(layer.channels) +
                              ") is no AOV of MBFeat; the nearest is '" +
                              nearestAovName(layer.layer) + "'.");
        return;
    }
    std::vector<std::string> suffixes;
    for (const std::string& channel : layer.channels) {
        suffixes.push_back(suffixOf(channel));
    }
    if (suffixes != aov->channels) {
        differences.push_back("Layer '" + layer.layer + "' of the AOV '" + aov->name +
                              "' has the channels " + quotedList(suffixes) + " instead of " +
                              quotedList(aov->channels) + ".");
    }
    const bool typeFits = aov->type == AovType::kInt
                              ? layer.type == "uint"
                              : layer.type == "half" || layer.type == "float";
    if (!typeFits) {
        differences.push_back("Layer '" + layer.layer + "' of the AOV '" + aov->name +
                              "' has the pixel type " + layer.type + " instead of " +
                              (aov->type == AovType::kInt ? "uint." : "half or float."));
    }
}

/// Layers that the header names but that are not there.
void checkPromises(const AovLayout& layout, std::vector<std::string>& differences) {
    const std::string prefix = layerAttributeName("");
    for (const auto& [name, aov] : layout.attributes) {
        if (name.compare(0, prefix.size(), prefix) != 0) {
            continue;
        }
        const std::string promised = name.substr(prefix.size());
        const bool found =
            std::any_of(layout.layers.begin(), layout.layers.end(),
                        [&](const AovLayoutEntry& layer) { return layer.layer == promised; });
        if (!found) {
            differences.push_back("The layer '" + promised + "' of the AOV '" + aov +
                                  "', which the header names, is missing.");
        }
    }
}

/// A deep file against the fields of a kept path.
void checkDeep(const AovLayout& layout, std::vector<std::string>& differences) {
    const bool extended = std::any_of(layout.layers.begin(), layout.layers.end(),
                                      [](const AovLayoutEntry& l) { return isExtendedAov(l.aov); });
    const std::vector<AovLayoutEntry> expected = deepLayers(extended);
    const auto find = [](const std::vector<AovLayoutEntry>& layers, const std::string& name) {
        return std::find_if(layers.begin(), layers.end(),
                            [&](const AovLayoutEntry& layer) { return layer.layer == name; });
    };
    for (const AovLayoutEntry& wanted : expected) {
        const auto found = find(layout.layers, wanted.layer);
        if (found == layout.layers.end()) {
            differences.push_back("The deep layer '" + wanted.layer + "' is missing.");
        } else if (found->channels != wanted.channels || found->type != wanted.type) {
            differences.push_back("The deep layer '" + wanted.layer + "' has the channels " +
                                  quotedList(found->channels) + " (" + found->type +
                                  ") instead of " + quotedList(wanted.channels) + " (" +
                                  wanted.type + ").");
        }
    }
    for (const AovLayoutEntry& layer : layout.layers) {
        if (find(expected, layer.layer) == expected.end()) {
            differences.push_back("The deep layer '" + layer.layer +
                                  "' is no field of MBFeat's paths.");
        }
    }
}

} // namespace

bool AovLayout::isOwn() const {
    return std::any_of(attributes.begin(), attributes.end(),
                       [](const auto& attribute) { return attribute.first == "mbfeat:version"; });
}

Result<AovLayout> describeProductFile(const std::string& path) {
    try {
        const Imf::MultiPartInputFile file(path.c_str(), 0);
        return readLayout(file);
    } catch (const std::exception& problem) {
        return Error{path, "The file cannot be read as OpenEXR: " + std::string(problem.what()) +
                               ". Check that it exists and is complete."};
    }
}

std::vector<std::string> checkProductFile(const std::string& path) {
    const Result<AovLayout> layout = describeProductFile(path);
    if (!layout) {
        return {layout.error().subject + ": " + layout.error().text};
    }
    std::vector<std::string> differences;
    if (!layout.value().isOwn()) {
        differences.emplace_back("The header has no mbfeat:version: MBFeat did not write this "
                                 "file.");
    }
    if (layout.value().deep) {
        checkDeep(layout.value(), differences);
        return differences;
    }
    for (const AovLayoutEntry& layer : layout.value().layers) {
        checkLayer(layer, differences);
    }
    checkPromises(layout.value(), differences);
    return differences;
}

} // namespace mbfeat
