#include "lab/messages/raw_image.hpp"

#include <array>
#include <gtest/gtest.h>

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/encode.hpp"

namespace kilvo::lab {
namespace raw_image_test {

using Pixels = std::vector<std::uint8_t>;

Pixels message(std::uint32_t width, std::uint32_t height, const std::string& encoding, std::uint32_t step, const Pixels& data,
               bool big_endian = false) {
  ByteWriter writer;
  writer.put(1U).put_time(time_from_ns(42)).put_string("camera").put(height).put(width).put_string(encoding);
  writer.put(static_cast<std::uint8_t>(big_endian)).put(step).put(static_cast<std::uint32_t>(data.size())).append(data.data(), data.size());
  return writer.take();
}

Pixels pixels_of(const Pixels& bytes, int channels) {
  const auto decoded = decode_image(bytes);
  EXPECT_TRUE(decoded) << decoded.reason();
  if (!decoded) return {};
  EXPECT_EQ(decoded->t, time_from_ns(42));
  EXPECT_EQ(decoded->image.channels, channels);
  return decoded->image.pixels;
}

TEST(DecodeImage, GreyStaysGreyAndRowPaddingGoes) {
  EXPECT_EQ(pixels_of(message(2, 2, "mono8", 3, {1, 2, 99, 3, 4, 99}), 1), (Pixels{1, 2, 3, 4}));
  EXPECT_EQ(pixels_of(message(2, 2, "mono8", 3, {1, 2, 99, 3, 4}), 1), (Pixels{1, 2, 3, 4})) << "the last row need not be padded";
}

TEST(DecodeImage, SixteenBitGreyKeepsItsHighByte) {
  EXPECT_EQ(pixels_of(message(2, 1, "mono16", 4, {0x34, 0x12, 0x78, 0x56}), 1), (Pixels{0x12, 0x56}));
  EXPECT_EQ(pixels_of(message(2, 1, "mono16", 4, {0x12, 0x34, 0x56, 0x78}, true), 1), (Pixels{0x12, 0x56}));
}

TEST(DecodeImage, ColoursComeOutRedGreenBlue) {
  EXPECT_EQ(pixels_of(message(1, 1, "rgb8", 3, {10, 20, 30}), 3), (Pixels{10, 20, 30}));
  EXPECT_EQ(pixels_of(message(1, 1, "bgr8", 3, {30, 20, 10}), 3), (Pixels{10, 20, 30}));
  EXPECT_EQ(pixels_of(message(1, 1, "rgba8", 4, {10, 20, 30, 5}), 3), (Pixels{10, 20, 30}));
  EXPECT_EQ(pixels_of(message(1, 1, "bgra8", 4, {30, 20, 10, 5}), 3), (Pixels{10, 20, 30}));
}

TEST(DecodeImage, ManyPixelsInARowComeOutRedGreenBlue) {
  // Of all lengths, since many bytes are turned at once; with and without padding.
  for (std::uint32_t width = 1; width < 40; ++width) {
    for (const std::uint32_t padding : {0U, 2U}) {
      const std::uint32_t height = 3, step = 3 * width + padding;
      Pixels blue_first(height * step), expected;
      for (std::size_t i = 0; i < blue_first.size(); ++i) blue_first[i] = static_cast<std::uint8_t>(7 * i + 3);
      for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
          for (const std::size_t channel : {2U, 1U, 0U}) expected.push_back(blue_first[y * step + 3 * x + channel]);
        }
      }
      ASSERT_EQ(pixels_of(message(width, height, "bgr8", step, blue_first), 3), expected) << width;
    }
  }
}

TEST(DecodeImage, AUniformMosaicGivesAUniformColourInEveryArrangement) {
  // Red 200, green 100, blue 50 everywhere: each arrangement puts them at its own places of the 2x2 block.
  const std::array<std::pair<std::string, std::array<std::uint8_t, 4>>, 4> arrangements{{{"bayer_rggb8", {200, 100, 100, 50}},
                                                                                         {"bayer_bggr8", {50, 100, 100, 200}},
                                                                                         {"bayer_gbrg8", {100, 50, 200, 100}},
                                                                                         {"bayer_grbg8", {100, 200, 50, 100}}}};
  for (const auto& [encoding, block] : arrangements) {
    Pixels mosaic;
    for (std::size_t y = 0; y < 6; ++y) {
      for (std::size_t x = 0; x < 4; ++x) mosaic.push_back(block[2 * (y % 2) + x % 2]);
    }
    const auto pixels = pixels_of(message(4, 6, encoding, 4, mosaic), 3);
    ASSERT_EQ(pixels.size(), 72U);
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
      EXPECT_EQ(pixels[i], 200) << encoding << " pixel " << i / 3;
      EXPECT_EQ(pixels[i + 1], 100) << encoding << " pixel " << i / 3;
      EXPECT_EQ(pixels[i + 2], 50) << encoding << " pixel " << i / 3;
    }
  }
}

TEST(DecodeImage, AOnePixelMosaicIsNoReasonToCrash) { EXPECT_EQ(pixels_of(message(1, 1, "bayer_rggb8", 1, {9}), 3).size(), 3U); }

TEST(DecodeImage, Yuv422IsReadInBothOrders) {
  const Pixels red_uyvy{90, 81, 240, 81}, red_yuyv{81, 90, 81, 240};
  for (const auto& pixels : {pixels_of(message(2, 1, "yuv422", 4, red_uyvy), 3), pixels_of(message(2, 1, "yuv422_yuy2", 4, red_yuyv), 3)}) {
    ASSERT_EQ(pixels.size(), 6U);
    for (std::size_t i = 0; i < 6; i += 3) {
      EXPECT_NEAR(pixels[i], 255, 2);
      EXPECT_NEAR(pixels[i + 1], 0, 2);
      EXPECT_NEAR(pixels[i + 2], 0, 2);
    }
  }
  EXPECT_EQ(pixels_of(message(1, 1, "yuv422", 2, {128, 235}), 3), (Pixels{255, 255, 255})) << "an odd row ends without a colour";
}

TEST(DecodeImage, RefusesWhatDoesNotFit) {
  EXPECT_EQ(decode_image(message(2, 2, "32FC1", 8, Pixels(16))).reason(), "sensor_msgs/Image: encoding 32FC1 is not read");
  EXPECT_FALSE(decode_image(message(0, 0, "mono8", 0, {})));
  EXPECT_FALSE(decode_image(message(4, 1, "rgb8", 4, Pixels(12)))) << "a row is longer than a step";
  EXPECT_FALSE(decode_image(message(4, 2, "mono8", 4, Pixels(7)))) << "the last pixel is missing";
  EXPECT_FALSE(decode_image(message(4, 0xFFFFFFFF, "mono8", 4, Pixels(8))));
  EXPECT_FALSE(decode_image(message(0xFFFFFFFF, 0xFFFFFFFF, "bgra8", 0xFFFFFFFF, Pixels(8))));
  EXPECT_EQ(decode_image(message(20'000, 20'000, "mono8", 20'000, Pixels(8))).reason(), "sensor_msgs/Image: 20000x20000 is too large");
}

TEST(DecodeImage, RefusesEveryShorterMessage) {
  const auto bytes = message(2, 2, "rgb8", 6, Pixels(12));
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_image(Bytes(bytes).first(size))) << size;
}

TEST(DecodeImage, ReadsWhatEncodeWrites) {
  for (const int channels : {1, 3}) {
    CameraImage image{time_from_ns(42), {3, 2, channels, {}}};
    for (int i = 0; i < 6 * channels; ++i) image.image.pixels.push_back(static_cast<std::uint8_t>(i));
    EXPECT_EQ(pixels_of(encode(image, "camera"), channels), image.image.pixels);
  }
}

}  // namespace raw_image_test
}  // namespace kilvo::lab
