// The header in C++: included twice, with the library's objects behind std::unique_ptr.

#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "gip.h"
#include "gip.h"

#include "test.h"

namespace {

struct FreeDecoder {
    void operator()(gip_decoder *decoder) const { gip_decoder_free(decoder); }
};

using Decoder = std::unique_ptr<gip_decoder, FreeDecoder>;

void check(gip_status status)
{
    if (status != GIP_STATUS_OK) {
        throw std::runtime_error(gip_last_error());
    }
}

Decoder open(const gip_buffer &file)
{
    gip_decoder *decoder = nullptr;
    check(gip_decoder_open(file.data, file.size, nullptr, &decoder));
    return Decoder(decoder);
}

int count_calls(const gip_progress *, void *user)
{
    ++*static_cast<unsigned *>(user);
    return 0;
}

} // namespace

static_assert(std::is_standard_layout<gip_view>::value, "a structure of C");
static_assert(sizeof(gip_status) == sizeof(std::int32_t), "statuses have 32 bits");

int main()
{
    constexpr unsigned width = 24, height = 18;
    std::vector<std::uint8_t> pixels;
    for (unsigned i = 0; i < width * height; i++) {
        pixels.push_back(static_cast<std::uint8_t>(i * 255 / (width * height)));
    }
    gip_source source = gip_source_default();
    source.width = width;
    source.height = height;
    source.color = GIP_COLOR_GRAY;
    source.samples = GIP_SAMPLES_U8;
    source.pixels = pixels.data();
    source.size = pixels.size();
    unsigned calls = 0;
    gip_encode_options options = gip_encode_options_default();
    options.target = GIP_TARGET_QUALITY;
    options.value = 80;
    options.effort = 1;
    options.progress = count_calls;
    options.user = &calls;
    gip_buffer file;
    check(gip_encode(&source, &options, &file, nullptr));
    CHECK(calls > 0);

    const Decoder decoder = open(file);
    gip_view view = gip_view_default();
    view.color = GIP_COLOR_RGB;
    std::vector<std::uint8_t> decoded(3 * pixels.size());
    check(gip_render(decoder.get(), &view, decoded.data(), 0, decoded.size()));
    double error = 0;
    for (std::size_t i = 0; i < pixels.size(); i++) {
        error += std::abs(static_cast<double>(decoded[3 * i + 1]) - pixels[i]);
    }
    CHECK(error / static_cast<double>(pixels.size()) < 8);
    gip_buffer_free(&file);

    bool is_refused = false;
    try {
        open(file);
    } catch (const std::runtime_error &refusal) {
        is_refused = *refusal.what() != '\0';
    }
    CHECK(is_refused);
    std::cout << "header: passed\n";
    return 0;
}
