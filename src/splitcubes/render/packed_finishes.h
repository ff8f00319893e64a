// Finishes as the shaders read them. Internal to render.
#pragma once

#include <splitcubes/geometry/finish.h>

#include <cstddef>
#include <vector>

namespace splitcubes::render {

/// A list of different finishes, texels of four floats one after the other. A finish takes: colour and
/// roughness; metalness and the counts of layers, stripes and speckles; stripe axis; four layers and eight
/// stripes, colour and bound; two speckles, colour and size, then share. Colours are linear.
class PackedFinishes {
  public:
    static constexpr std::size_t texels_each = 20;
    /// Number of them, which every driver takes.
    static constexpr std::size_t max_count = 65536 / texels_each;

    /// Returns the number of a finish; -1 if there are too many.
    int add(const geometry::Finish& finish);
    const std::vector<float>& data() const { return data_; }

  private:
    std::vector<geometry::Finish> finishes_;
    std::vector<float> data_;
};

}  // namespace splitcubes::render
