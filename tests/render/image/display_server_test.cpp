// What a viewer gets of a picture while it is made, and what becomes of viewers that do not do their part.
#include "nephele/render/image/display_server.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "tests/support/packet_receiver.h"

namespace nephele {
namespace {

using test::PacketReceiver;
using Habit = PacketReceiver::Habit;

Image pictureOf(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  float value = 0;
  for (const char* name : {"R", "G", "B", "A", "Z", "light_sun.R"})
    for (float& v : image.add(name, std::string(name).size() == 1).values) v = std::sin(value += 0.37f);
  image.channels[4].values[1] = INFINITY;
  return image;
}

DisplayServer::Options serverAt(int port) {
  return {.host = "127.0.0.1", .port = port, .patience = 0.3};
}

// Tiles of 16 x 16, from all threads.
void showTiles(DisplayServer& server, const Image& image) {
  const int across = (image.width + 15) / 16, down = (image.height + 15) / 16;
  parallelFor(std::size_t(across * down), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const int x = int(i) % across * 16, y = int(i) / across * 16;
      server.show({x, y, std::min(x + 16, image.width), std::min(y + 16, image.height)}, image);
    }
  });
}

TEST(DisplayServer, SendsEveryPixelAsItIs) {
  PacketReceiver viewer;
  const Image image = pictureOf(203, 101);
  {
    DisplayServer server(serverAt(viewer.port()), "a cloud.exr");
    showTiles(server, image);
    EXPECT_EQ(server.finish(), "");
    // Nothing more is taken.
    server.show({0, 0, 16, 16}, image);
  }
  viewer.finish();
  EXPECT_EQ(viewer.problem, "");
  ASSERT_EQ(viewer.pictures.size(), 1u);
  const auto& shown = viewer.pictures.at("a cloud.exr");
  EXPECT_EQ(shown.width, 203);
  EXPECT_EQ(shown.height, 101);
  ASSERT_EQ(shown.channels.size(), image.channels.size());
  for (const Image::Channel& channel : image.channels)
    EXPECT_EQ(shown.channels.at(channel.name), channel.values) << channel.name;
  EXPECT_EQ(shown.pixels, 203u * 101u);
  // A picture of this name from before is put away first.
  EXPECT_EQ(viewer.closings, 1u);
}

TEST(DisplayServer, ShowsTheNewestValuesOfTilesThatComeAgain) {
  PacketReceiver viewer;
  Image image = pictureOf(64, 64);
  DisplayServer server(serverAt(viewer.port()), "passes");
  for (int pass = 0; pass != 50; ++pass) {
    for (float& v : image.channels[0].values) v = float(pass);
    showTiles(server, image);
  }
  EXPECT_EQ(server.finish(), "");
  viewer.finish();
  EXPECT_EQ(viewer.problem, "");
  EXPECT_EQ(viewer.pictures.at("passes").channels.at("R"), image.channels[0].values);
}

TEST(DisplayServer, ShowsPicturesThatHaveNoTiles) {
  PacketReceiver viewer;
  Image image = pictureOf(8, 4);
  DisplayServer server(serverAt(viewer.port()), "empty");
  server.showUnlessBegun(image);
  image.channels[0].values[0] = 7;
  server.showUnlessBegun(image);
  EXPECT_EQ(server.finish(), "");
  viewer.finish();
  EXPECT_NE(viewer.pictures.at("empty").channels.at("R")[0], 7);
}

// What went wrong with a picture of 6 x 2 MB, which no buffer of the system holds.
std::string problemWith(int port) {
  const Image image = pictureOf(1024, 512);
  const auto start = std::chrono::steady_clock::now();
  std::string problem;
  {
    DisplayServer server(serverAt(port), "large");
    showTiles(server, image);
    // The work goes on at once, whatever the viewer does.
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(300));
    problem = server.finish();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(1500));
  return problem;
}

TEST(DisplayServer, GivesUpViewersThatDoNotDoTheirPart) {
  PacketReceiver deaf(Habit::takesNothing), early(Habit::closesEarly);
  EXPECT_EQ(problemWith(deaf.port()), "takes nothing any more");
  EXPECT_EQ(problemWith(early.port()), "has closed the connection");
  int port = 0;
  {
    const PacketReceiver gone;
    port = gone.port();
  }
  EXPECT_EQ(problemWith(port), "is not there");
}

TEST(DisplayServer, MayBeLeftAtAnyTime) {
  PacketReceiver deaf(Habit::takesNothing);
  const Image image = pictureOf(1024, 512);
  DisplayServer server(serverAt(deaf.port()), "left");
  showTiles(server, image);
}

TEST(DisplayServer, UnderstandsHostsAndPorts) {
  EXPECT_EQ(DisplayServer::parse("localhost").port, 14158);
  EXPECT_EQ(DisplayServer::parse("localhost").host, "localhost");
  EXPECT_EQ(DisplayServer::parse("10.0.0.7:99").host, "10.0.0.7");
  EXPECT_EQ(DisplayServer::parse("10.0.0.7:99").port, 99);
  EXPECT_EQ(DisplayServer::parse("[::1]:99").host, "::1");
  EXPECT_EQ(DisplayServer::parse("[::1]:99").port, 99);
  EXPECT_EQ(DisplayServer::parse("[::1]").port, 14158);
  for (const char* text :
       {"", ":99", "host:", "host:0", "host:65536", "host:x", "host:9x", "::1", "[::1]9", "a b"})
    EXPECT_THROW(DisplayServer::parse(text), Error) << text;
}

}  // namespace
}  // namespace nephele
