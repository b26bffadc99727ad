#include "lab/messages/compressed_image.hpp"

#include <array>
#include <memory>
#include <png.h>
#include <string>
#include <turbojpeg.h>
#include <type_traits>

#include "lab/messages/raw_image.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {
namespace {

template <std::size_t n>
bool begins_with(Bytes bytes, const std::array<std::uint8_t, n>& magic) {
  return bytes.size() >= n && std::equal(magic.begin(), magic.end(), bytes.begin());
}

bool too_large(std::size_t width, std::size_t height) { return width == 0 || height == 0 || width > most_pixels / height; }

DecodeError size_error(const char* kind, std::size_t width, std::size_t height) {
  return {std::string(kind) + " image of " + std::to_string(width) + "x" + std::to_string(height) + " pixels is not read"};
}

Image blank(std::size_t width, std::size_t height, bool grey) {
  Image image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.channels = grey ? 1 : 3;
  image.pixels.resize(width * height * static_cast<std::size_t>(image.channels));
  return image;
}

/// 16-bit samples come linear; the high byte is what a camera would have given with 8 bits.
Decoded<Image> finish_deep_png(png_image& png, bool grey) {
  png.format = grey ? PNG_FORMAT_LINEAR_Y : PNG_FORMAT_LINEAR_RGB;
  Image image = blank(png.width, png.height, grey);
  std::vector<std::uint16_t> deep(image.pixels.size());
  if (png_image_finish_read(&png, nullptr, deep.data(), 0, nullptr) == 0) return DecodeError{"PNG: " + std::string(png.message)};
  for (std::size_t i = 0; i < deep.size(); ++i) image.pixels[i] = static_cast<std::uint8_t>(deep[i] >> 8);
  return image;
}

Decoded<Image> finish_png(png_image& png) {
  if (too_large(png.width, png.height)) return size_error("PNG", png.width, png.height);
  const bool grey = (png.format & PNG_FORMAT_FLAG_COLOR) == 0;
  if ((png.format & PNG_FORMAT_FLAG_LINEAR) != 0) return finish_deep_png(png, grey);
  png.format = grey ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  Image image = blank(png.width, png.height, grey);
  const png_color black{0, 0, 0};  // what transparent pixels are laid over
  if (png_image_finish_read(&png, &black, image.pixels.data(), 0, nullptr) == 0) return DecodeError{"PNG: " + std::string(png.message)};
  return image;
}

}  // namespace

Decoded<Image> decode_jpeg(Bytes file, bool with_colours) {
  const std::unique_ptr<void, decltype(&tjDestroy)> decoder(tjInitDecompress(), &tjDestroy);
  if (!decoder) return DecodeError{"JPEG: no decoder"};
  int width = 0, height = 0, subsampling = 0, colours = 0;
  const auto size = static_cast<unsigned long>(file.size());
  if (tjDecompressHeader3(decoder.get(), file.data(), size, &width, &height, &subsampling, &colours) != 0) {
    return DecodeError{std::string("JPEG: ") + tjGetErrorStr2(decoder.get())};
  }
  if (width <= 0 || height <= 0 || too_large(static_cast<std::size_t>(width), static_cast<std::size_t>(height))) {
    return size_error("JPEG", static_cast<std::size_t>(width), static_cast<std::size_t>(height));
  }
  // The greys are in the file: of colours, which take as long as half of them, only the planes are read, and only where they are wanted.
  const bool planes =
      colours == TJCS_YCbCr && tjPlaneWidth(0, width, subsampling) == width && tjPlaneHeight(0, height, subsampling) == height;
  const bool grey = planes || colours == TJCS_GRAY;
  Image image = blank(static_cast<std::size_t>(width), static_cast<std::size_t>(height), grey);
  // A warning means that the data ended early or did not make sense: the rest of the picture would be grey.
  const int flags = TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
  int failed = 0;
  if (planes && with_colours) {
    image.chroma_width = tjPlaneWidth(1, width, subsampling);
    image.chroma_height = tjPlaneHeight(1, height, subsampling);
    const auto plane = static_cast<std::size_t>(image.chroma_width) * static_cast<std::size_t>(image.chroma_height);
    image.chroma.resize(2 * plane);
    std::array<unsigned char*, 3> into{image.pixels.data(), image.chroma.data(), image.chroma.data() + plane};
    failed = tjDecompressToYUVPlanes(decoder.get(), file.data(), size, into.data(), width, nullptr, height, flags);
  } else {
    failed = tjDecompress2(decoder.get(), file.data(), size, image.pixels.data(), width, 0, height, grey ? TJPF_GRAY : TJPF_RGB, flags);
  }
  if (failed != 0) return DecodeError{std::string("JPEG: ") + tjGetErrorStr2(decoder.get())};
  return image;
}

Decoded<Image> decode_png(Bytes file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, file.data(), file.size()) == 0) return DecodeError{"PNG: " + std::string(png.message)};
  auto image = finish_png(png);
  png_image_free(&png);
  return image;
}

Decoded<CameraImage> decode_compressed_image(const WireMessage& message, bool with_colours) {
  constexpr std::array<std::uint8_t, 3> jpeg_magic{0xFF, 0xD8, 0xFF};
  constexpr std::array<std::uint8_t, 8> png_magic{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const auto m = read_message<CompressedImageMessage>(message);
  if (!m) return DecodeError{m.reason()};
  const Bytes file = m->data.raw;
  const bool jpeg = begins_with(file, jpeg_magic);
  if (!jpeg && !begins_with(file, png_magic)) {
    return DecodeError{"sensor_msgs/CompressedImage: neither JPEG nor PNG (format " + std::string(m->format.substr(0, 40)) + ")"};
  }
  auto image = jpeg ? decode_jpeg(file, with_colours) : decode_png(file);
  if (!image) return DecodeError{image.reason()};
  CameraImage decoded;
  decoded.t = m->header.stamp;
  decoded.image = *std::move(image);
  return decoded;
}

}  // namespace kilvo::lab
