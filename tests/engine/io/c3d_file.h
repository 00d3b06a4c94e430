// Builds C3D files byte by byte, for all three processors, by the format's description (c3d.org).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace counterpoint::test {

struct C3dFile {
  int processor = 84;  ///< 84 Intel, 85 DEC, 86 MIPS
  bool reals = true;   ///< points and samples are reals, else words
  double scale = 0.5;  ///< scale of points stored as words
  int first = 1, last = 1;
  int points = 0, channels = 0, samples = 1;  ///< samples of each channel in a frame
  double rate = 100.0;
  std::string parameters;  ///< parameter records, appended by the functions below
  std::string frames;      ///< appended by value()

  void word(std::string& out, int x) const {
    const char low = static_cast<char>(x & 0xff), high = static_cast<char>(x >> 8 & 0xff);
    out += processor == 86 ? high : low;
    out += processor == 86 ? low : high;
  }
  void real(std::string& out, double x) const {
    auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(x));
    if (processor == 85 && x != 0.0) bits += 2u << 23;  // VAX: bias 128, fractions from 1/2
    const int high = static_cast<int>(bits >> 16), low = static_cast<int>(bits & 0xffff);
    word(out, processor == 84 ? low : high);
    word(out, processor == 84 ? high : low);
  }
  /// Appends a coordinate, the fourth value of a point, or a sample.
  C3dFile& value(double x) {
    reals ? real(frames, x) : word(frames, static_cast<int>(x));
    return *this;
  }
  /// Appends a point in the file's unit; words hold multiples of scale.
  C3dFile& point(double x, double y, double z, double residual = 0.0) {
    for (const double c : {x, y, z}) value(reals ? c : c / scale);
    return value(residual);
  }

  void record(int group, const std::string& name, const std::string& content) {
    parameters += static_cast<char>(name.size());
    parameters += static_cast<char>(group);
    parameters += name;
    word(parameters, static_cast<int>(content.size()) + 2);
    parameters += content;
  }
  void group(int number, const std::string& name) { record(-number, name, std::string(1, '\0')); }
  void text(int group, const std::string& name, const std::string& text) {
    std::string content{'\xff', 1, static_cast<char>(text.size())};
    record(group, name, content + text + '\0');
  }
  void texts(int group, const std::string& name, const std::vector<std::string>& all, int width) {
    std::string content{'\xff', 2, static_cast<char>(width), static_cast<char>(all.size())};
    for (std::string text : all) {
      text.resize(static_cast<std::size_t>(width), ' ');
      content += text;
    }
    record(group, name, content + '\0');
  }
  void words(int group, const std::string& name, const std::vector<int>& all) {
    std::string content{2, 1, static_cast<char>(all.size())};
    for (const int x : all) word(content, x);
    record(group, name, content + '\0');
  }
  void reals_of(int group, const std::string& name, const std::vector<double>& all) {
    std::string content{4, 1, static_cast<char>(all.size())};
    for (const double x : all) real(content, x);
    record(group, name, content + '\0');
  }

  std::string bytes() const {
    std::string section{1, 0x50, 0, static_cast<char>(processor)};
    section += parameters;
    section.resize((section.size() / 512 + 1) * 512);
    std::string all{2, 0x50};
    word(all, points);
    word(all, channels * samples);
    word(all, first);
    word(all, last);
    word(all, 10);
    real(all, reals ? -scale : scale);
    word(all, static_cast<int>(2 + section.size() / 512));
    word(all, samples);
    real(all, rate);
    all.resize(512);
    return all + section + frames;
  }
};

}  // namespace counterpoint::test
