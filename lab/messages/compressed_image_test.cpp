#include "lab/messages/compressed_image.hpp"

#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/raw_image.hpp"

namespace kilvo::lab {
namespace compressed_image_test {

using File = std::vector<std::uint8_t>;

constexpr int width = 32, height = 16;

/// Brightness grows to the right; in colour, red and blue differ from it.
File gradient(int channels) {
  File pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int grey = 40 + 4 * x;
      if (channels == 3) pixels.push_back(static_cast<std::uint8_t>(grey + 30));
      pixels.push_back(static_cast<std::uint8_t>(grey));
      if (channels == 3) pixels.push_back(static_cast<std::uint8_t>(grey - 30));
    }
  }
  return pixels;
}

File jpeg(int channels) {
  tjhandle encoder = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  const bool grey = channels == 1;
  tjCompress2(encoder, gradient(channels).data(), width, 0, height, grey ? TJPF_GRAY : TJPF_RGB, &out, &size,
              grey ? TJSAMP_GRAY : TJSAMP_444, 95, 0);
  File file(out, out + size);
  tjFree(out);
  tjDestroy(encoder);
  return file;
}

File png(const void* pixels, png_uint_32 format, std::uint32_t w = width, std::uint32_t h = height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = w;
  image.height = h;
  image.format = format;
  png_alloc_size_t size = 0;
  EXPECT_NE(png_image_write_to_memory(&image, nullptr, &size, 0, pixels, 0, nullptr), 0) << image.message;
  File file(size);
  EXPECT_NE(png_image_write_to_memory(&image, file.data(), &size, 0, pixels, 0, nullptr), 0) << image.message;
  file.resize(size);
  return file;
}

File message(const File& file, const std::string& format = "jpeg") {
  ByteWriter writer;
  writer.put(1U).put_time(time_from_ns(42)).put_string("camera").put_string(format);
  writer.put(static_cast<std::uint32_t>(file.size())).append(file.data(), file.size());
  return writer.take();
}

void expect_image(const Decoded<CameraImage>& decoded, int channels, int tolerance) {
  ASSERT_TRUE(decoded) << decoded.reason();
  EXPECT_EQ(decoded->t, time_from_ns(42));
  EXPECT_EQ(decoded->image.width, width);
  EXPECT_EQ(decoded->image.height, height);
  ASSERT_EQ(decoded->image.channels, channels);
  const File expected = gradient(channels);
  ASSERT_EQ(decoded->image.pixels.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(decoded->image.pixels[i], expected[i], tolerance) << i;
}

/// The greys of the gradient in colour, and how far its blue and its red differ from them.
void expect_planes(const Decoded<CameraImage>& decoded) {
  ASSERT_TRUE(decoded) << decoded.reason();
  const Image& image = decoded->image;
  ASSERT_EQ(image.channels, 1);
  ASSERT_EQ(image.pixels.size(), static_cast<std::size_t>(width * height));
  ASSERT_EQ(image.chroma_width, width);
  ASSERT_EQ(image.chroma_height, height);
  ASSERT_EQ(image.chroma.size(), static_cast<std::size_t>(2 * width * height));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    ASSERT_NEAR(image.pixels[i], 40 + 4 * static_cast<int>(i % width) + 5.55, 4) << i;
    ASSERT_NEAR(image.chroma[i], 108, 4) << i;
    ASSERT_NEAR(image.chroma[image.pixels.size() + i], 145, 4) << i;
  }
}

TEST(DecodeCompressedImage, ReadsJpegInColourAndGrey) {
  expect_planes(decode_compressed_image(message(jpeg(3))));
  expect_image(decode_compressed_image(message(jpeg(1))), 1, 4);
}

TEST(DecodeCompressedImage, GreysAreTheSameWithoutColours) {
  const auto with = decode_compressed_image(message(jpeg(3))), without = decode_compressed_image(message(jpeg(3)), false);
  ASSERT_TRUE(with && without);
  EXPECT_EQ(with->image.pixels, without->image.pixels);
  EXPECT_TRUE(without->image.chroma.empty());
}

TEST(DecodeCompressedImage, ReadsPngInColourAndGrey) {
  expect_image(decode_compressed_image(message(png(gradient(3).data(), PNG_FORMAT_RGB))), 3, 0);
  expect_image(decode_compressed_image(message(png(gradient(1).data(), PNG_FORMAT_GRAY))), 1, 0);
}

TEST(DecodeCompressedImage, KeepsTheHighByteOfDeepPng) {
  std::vector<std::uint16_t> deep;
  for (const auto value : gradient(1)) deep.push_back(static_cast<std::uint16_t>(value * 256 + 77));
  expect_image(decode_compressed_image(message(png(deep.data(), PNG_FORMAT_LINEAR_Y))), 1, 0);
}

TEST(DecodeCompressedImage, DropsTheAlphaOfOpaquePixels) {
  File pixels;
  const File colours = gradient(3);
  for (std::size_t i = 0; i < colours.size(); i += 3) pixels.insert(pixels.end(), {colours[i], colours[i + 1], colours[i + 2], 255});
  expect_image(decode_compressed_image(message(png(pixels.data(), PNG_FORMAT_RGBA))), 3, 0);
}

TEST(DecodeCompressedImage, TheFormatTextMayLie) {
  expect_planes(decode_compressed_image(message(jpeg(3), "bgr8; png compressed bgr8")));
  expect_image(decode_compressed_image(message(png(gradient(1).data(), PNG_FORMAT_GRAY), "jpeg")), 1, 0);
}

TEST(DecodeCompressedImage, RefusesPicturesThatAreCutShort) {
  for (const File& file : {jpeg(3), png(gradient(3).data(), PNG_FORMAT_RGB)}) {
    for (const double part : {0.0, 0.1, 0.3, 0.6, 0.8}) {
      const File cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(file.size())));
      EXPECT_FALSE(decode_compressed_image(message(cut))) << part;
    }
  }
}

TEST(DecodeCompressedImage, RefusesWhatIsNoPicture) {
  EXPECT_EQ(decode_compressed_image(message({1, 2, 3}, "16UC1; compressedDepth")).reason(),
            "sensor_msgs/CompressedImage: neither JPEG nor PNG (format 16UC1; compressedDepth)");
  const auto bytes = message(jpeg(1));
  for (std::size_t size = 0; size < bytes.size(); size += 7) EXPECT_FALSE(decode_compressed_image(Bytes(bytes).first(size))) << size;
}

TEST(DecodeCompressedImage, APictureThatClaimsFourHundredMegapixelsIsNotAllocated) {
  File bomb = jpeg(1);
  for (std::size_t i = 0; i + 9 < bomb.size(); ++i) {
    if (bomb[i] == 0xFF && bomb[i + 1] == 0xC0) {  // start of frame: length, precision, height, width
      bomb[i + 5] = bomb[i + 7] = 20'000 >> 8;
      bomb[i + 6] = bomb[i + 8] = 20'000 & 0xFF;
    }
  }
  EXPECT_EQ(decode_compressed_image(message(bomb)).reason(), "JPEG image of 20000x20000 pixels is not read");

  const File black(25'000'000);
  const auto refused = decode_compressed_image(message(png(black.data(), PNG_FORMAT_GRAY, 5'000, 5'000)));
  EXPECT_EQ(refused.reason(), "PNG image of 5000x5000 pixels is not read");
}

TEST(DecodeCompressedImage, SurvivesEveryFlippedByte) {
  for (const File& file : {jpeg(3), png(gradient(1).data(), PNG_FORMAT_GRAY)}) {
    for (std::size_t i = 0; i < file.size(); ++i) {
      File flipped = file;
      flipped[i] = static_cast<std::uint8_t>(flipped[i] ^ 0x5A);
      const auto decoded = decode_compressed_image(message(flipped));
      EXPECT_LE(decoded ? decoded->image.pixels.size() : 0, 3 * most_pixels);
    }
  }
}

}  // namespace compressed_image_test
}  // namespace kilvo::lab
