// Which header it is, then voxels as indices of labels. Nothing is allocated before the bytes that there are
// have been compared with those that the header promises.
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <unordered_map>

#include "file.h"
#include "header_lines.h"
#include "messages.h"

namespace labels {
namespace {

constexpr uint64_t kMaxBytes = uint64_t(1) << 32;
// Deflate packs at most 258 bytes into 2 bits.
constexpr uint64_t kMaxDeflated = 1032;
constexpr size_t kBlock = size_t(1) << 18;

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace

void refuse(const std::string &path, const char *sentence, ...) {
  char text[1024];
  va_list values;
  va_start(values, sentence);
  std::vsnprintf(text, sizeof text, sentence, values);
  va_end(values);
  throw cli::Failure(cli::kBadInput, path + ": " + text);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char &c : out)
    if (c >= 'A' && c <= 'Z') c = char(c + ('a' - 'A'));
  return out;
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> out;
  while (!(text = trimmed(text)).empty()) {
    size_t n = 0;
    while (n < text.size() && !is_space(text[n])) ++n;
    out.push_back(text.substr(0, n));
    text.remove_prefix(n);
  }
  return out;
}

bool to_number(std::string_view text, double &out) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto result = std::from_chars(text.data(), text.data() + text.size(), out);
  return !text.empty() && result.ec == std::errc() && result.ptr == text.data() + text.size() &&
         std::isfinite(out);
}

bool to_number(std::string_view text, int64_t &out) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto result = std::from_chars(text.data(), text.data() + text.size(), out);
  return !text.empty() && result.ec == std::errc() && result.ptr == text.data() + text.size();
}

std::string quoted_part(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 40)) out += c >= ' ' && c < 127 ? c : '?';
  return out + (text.size() > 40 ? "...\"" : "\"");
}

double unit_of(std::string_view name) {
  const std::string word = lower(name);
  constexpr std::pair<double, const char *> kUnits[] = {{1e-3, "mm,millimeter,millimeters,millimetre"},
                                                        {1, "m,meter,meters,metre"},
                                                        {1e-2, "cm,centimeter"},
                                                        {1e-1, "dm"},
                                                        {1e-6, "um,\xc2\xb5m,\xce\xbcm,micrometer,micron"},
                                                        {0.0254, "inch,in"}};
  for (const auto &[meters, names] : kUnits)
    if (is_one_of(word, names)) return meters;
  return 0;
}

double Volume::cell() const {
  const auto &a = axis;
  return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
         a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
         a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}

std::array<Vec, 3> Volume::inverse() const {
  Vec a[3];
  for (size_t k = 0; k < 3; ++k) std::copy_n(axis[k], 3, a[k].begin());
  std::array<Vec, 3> out = {cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])};
  for (Vec &row : out)
    for (double &x : row) x /= cell();
  return out;
}

namespace {

// Takes the voxels as they come, in blocks, so that the values of a large file are never there twice.
class Collector {
 public:
  Collector(const std::string &path, const Encoding &encoding, Volume &out)
      : path_(path), encoding_(encoding), out_(out), wanted_(out.voxels()) {
    out_.voxel.reserve(wanted_);
    out_.value = {0};
    index_ = {{0, 0}};
  }
  bool surplus() const { return surplus_; }  // more bytes came than the voxels have
  bool full() const { return out_.voxel.size() == wanted_; }
  uint64_t missing() const { return (wanted_ - out_.voxel.size()) * encoding_.bytes - nheld_; }

  void take(const char *bytes, size_t n) {
    while (n > 0 && !full()) {
      const size_t part = std::min(n, size_t(encoding_.bytes) - nheld_);
      std::memcpy(held_ + nheld_, bytes, part);
      nheld_ += part;
      bytes += part;
      n -= part;
      if (nheld_ < encoding_.bytes) return;
      nheld_ = 0;
      out_.voxel.push_back(index_of(decoded()));
    }
    surplus_ = surplus_ || n > 0;
  }

  // Labels in ascending order, whatever the order in which voxels showed them.
  void sort() {
    std::vector<uint16_t> order(out_.value.size()), place(out_.value.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = uint16_t(i);
    std::ranges::sort(order, [&](uint16_t a, uint16_t b) {
      const int64_t va = out_.value[a], vb = out_.value[b];
      return (va != 0) != (vb != 0) ? va == 0 : va < vb;
    });
    std::vector<int64_t> value;
    for (size_t i = 0; i < order.size(); ++i) {
      place[order[i]] = uint16_t(i);
      value.push_back(out_.value[order[i]]);
    }
    out_.value = std::move(value);
    for (uint16_t &v : out_.voxel) v = place[v];
  }

 private:
  int64_t decoded() const {
    uint64_t u = 0;
    for (uint32_t i = 0; i < encoding_.bytes; ++i) {
      const uint32_t place = encoding_.big_endian ? encoding_.bytes - 1 - i : i;
      u |= uint64_t(held_[i]) << (8 * place);
    }
    if (!encoding_.is_signed && encoding_.bytes == 8 && (u >> 63))
      refuse(path_, "voxel %zu has the label %llu; labels below 2^63 are read", out_.voxel.size(),
             static_cast<unsigned long long>(u));
    const uint32_t free = 64 - 8 * encoding_.bytes;
    return encoding_.is_signed ? int64_t(u << free) >> free : int64_t(u);
  }

  uint16_t index_of(int64_t value) {
    if (value == last_) return last_index_;
    const auto [entry, is_new] = index_.emplace(value, uint16_t(out_.value.size()));
    if (is_new) {
      if (out_.value.size() == kMaxLabels + 1)
        refuse(path_,
               "more than %zu values differ from 0, so these are gray values and not labels; give the label "
               "map that "
               "a segmentation program writes",
               kMaxLabels);
      out_.value.push_back(value);
    }
    last_ = value;
    return last_index_ = entry->second;
  }

  const std::string &path_;
  const Encoding encoding_;
  Volume &out_;
  const size_t wanted_;
  std::unordered_map<int64_t, uint16_t> index_;
  int64_t last_ = 0;
  uint16_t last_index_ = 0;
  unsigned char held_[8] = {};
  size_t nheld_ = 0;
  bool surplus_ = false;
};

[[noreturn]] void truncated(const std::string &path, uint64_t missing) {
  refuse(path,
         "the voxels end %llu bytes too early: the file is cut off, or its header gives another size or "
         "type; copy or save it again",
         static_cast<unsigned long long>(missing));
}

// gzip and zlib alike; members that follow each other are one stream.
void inflate_into(const std::string &path, std::string_view packed, uint64_t skip, Collector &out) {
  struct Stream {
    z_stream z = {};
    Stream() {
      if (inflateInit2(&z, 15 + 32) != Z_OK) throw std::bad_alloc();
    }
    ~Stream() { inflateEnd(&z); }
  } stream;
  z_stream &z = stream.z;
  std::vector<char> block(kBlock);
  while (!out.surplus()) {
    if (z.avail_in == 0) {  // by blocks: zlib counts in 32 bits
      z.next_in = reinterpret_cast<Bytef *>(const_cast<char *>(packed.data()));
      z.avail_in = uInt(std::min(packed.size(), kBlock));
      packed.remove_prefix(z.avail_in);
    }
    z.next_out = reinterpret_cast<Bytef *>(block.data());
    z.avail_out = uInt(block.size());
    const int code = inflate(&z, Z_NO_FLUSH);
    const size_t n = block.size() - z.avail_out, skipped = size_t(std::min(uint64_t(n), skip));
    skip -= skipped;
    out.take(block.data() + skipped, n - skipped);
    if (code == Z_STREAM_END && z.avail_in + packed.size() > 0 && !out.full()) inflateReset(&z);
    else if (code == Z_BUF_ERROR || (code == Z_OK && z.avail_in + packed.size() == 0 && z.avail_out > 0))
      break;
    else if (code == Z_STREAM_END) break;
    else if (code == Z_MEM_ERROR) throw std::bad_alloc();
    else if (code != Z_OK)
      refuse(path, "the packed voxels are damaged at byte %llu of them; copy or save the file again",
             static_cast<unsigned long long>(z.total_in));
  }
  if (!out.full()) truncated(path, out.missing());
}

// Bytes before the voxels, by lines and by bytes.
std::string_view skipped(const std::string &path, const Stored &stored, std::string_view bytes,
                         uint64_t promised) {
  for (uint32_t i = 0; i < stored.skip_lines; ++i) {
    const size_t end = bytes.find('\n');
    if (end == std::string_view::npos) refuse(path, "line skip goes beyond the end of the file");
    bytes.remove_prefix(end + 1);
  }
  if (stored.skip < 0) {
    if (stored.encoding.compressed) refuse(path, "a skip of -1 is for raw voxels; these are packed");
    if (bytes.size() < promised) truncated(path, promised - bytes.size());
    return bytes.substr(bytes.size() - promised);
  }
  if (uint64_t(stored.skip) > bytes.size()) refuse(path, "the bytes to skip go beyond the end of the file");
  return bytes.substr(size_t(stored.skip));
}

void take_voxels(const std::string &path, const Stored &stored, std::string_view bytes, uint64_t promised,
                 Collector &out) {
  bytes = skipped(path, stored, bytes, promised);
  if (!stored.encoding.compressed) {
    if (bytes.size() < promised) truncated(path, promised - bytes.size());
    out.take(bytes.data(), bytes.size());
    return;
  }
  if (promised / kMaxDeflated > bytes.size()) truncated(path, promised - bytes.size() * kMaxDeflated);
  inflate_into(path, bytes, stored.skip_unpacked, out);
}

std::string beside(const std::string &path, const std::string &name) {
  const size_t slash = path.find_last_of('/');
  return name[0] == '/' || slash == std::string::npos ? name : path.substr(0, slash + 1) + name;
}

void read_voxels(const std::string &path, std::string_view bytes, const Stored &stored, Volume &out) {
  const uint64_t promised = uint64_t(out.voxels()) * stored.encoding.bytes;
  if (promised > kMaxBytes)
    refuse(path, "%u x %u x %u voxels of %u bytes are more than 4 GiB; crop the volume", out.size[0],
           out.size[1], out.size[2], stored.encoding.bytes);
  std::string data, file = path;
  std::string_view held = bytes.substr(stored.data_at);
  if (!stored.file.empty()) {
    if (path.empty()) refuse("volume", "the voxels lie in a file of their own, which is not read here");
    file = beside(path, stored.file);
    try {
      data = cli::read_file(file, kMaxBytes, "the voxels of a label map");
    } catch (const cli::Failure &e) {
      refuse(path, "its voxels lie in a file of their own that cannot be read: %s", e.what());
    }
    held = data;
  }
  // before as much is reserved as the header says
  if (promised / (stored.encoding.compressed ? kMaxDeflated : 1) > held.size())
    truncated(file, promised - held.size());
  Collector collector(file, stored.encoding, out);
  take_voxels(file, stored, held, promised, collector);
  collector.sort();
  if (collector.surplus())
    out.notes.push_back(
        "more bytes follow than the header's voxels have, and were left out; check its sizes and its type");
}

// Axes that span a space, with steps that a volume of an organ may have.
void check_axes(const std::string &path, const Volume &v) {
  double length[3];
  for (int k = 0; k < 3; ++k) {
    length[k] =
        std::sqrt(v.axis[k][0] * v.axis[k][0] + v.axis[k][1] * v.axis[k][1] + v.axis[k][2] * v.axis[k][2]);
    if (!(length[k] > 0))
      refuse(path, "the spacing of axis %d is 0; give the distance between its voxels in the header", k);
    if (!(length[k] >= 1e-9 && length[k] <= 1e3))
      refuse(path,
             "the spacing of axis %d is %g m; from 1e-9 to 1e3 are read: check the unit, or give it by "
             "--unit",
             k, length[k]);
    if (!(std::fabs(v.origin[k]) <= 1e6))
      refuse(path, "the origin lies at %g m; at most 1e6 m are read: check the unit, or give it by --unit",
             v.origin[k]);
  }
  if (!(std::fabs(v.cell()) > 0.1 * length[0] * length[1] * length[2]))
    refuse(path,
           "the axes do not span a space: two of the directions are nearly the same; correct them in the "
           "header");
}

}  // namespace

Volume read_labels(const std::string &path, std::string_view bytes, double unit) {
  const std::string where = path.empty() ? "volume" : path;
  Stored stored;
  if (bytes.substr(0, 4) == "NRRD") stored = read_nrrd(where, bytes);
  else if (trimmed(bytes.substr(0, bytes.find('\n'))).find('=') != std::string_view::npos)
    stored = read_metaimage(where, bytes);
  else if (bytes.substr(0, 2) == "\x1f\x8b")
    refuse(where,
           "is packed as a whole (a NIfTI file, perhaps); save the label map as .nrrd or .mha, whose voxels "
           "may be packed");
  else refuse(where, "is neither NRRD nor MetaImage; save the label map as .nrrd or .mha");
  Volume out = std::move(stored.volume);
  if (unit == 0) unit = stored.unit;
  if (unit == 0) {
    unit = 1e-3;
    out.notes.push_back("the file names no unit of length; millimeters were taken (--unit gives another)");
  }
  for (int k = 0; k < 3; ++k) {
    out.origin[k] *= unit;
    for (double &x : out.axis[k]) x *= unit;
  }
  check_axes(where, out);
  read_voxels(path, bytes, stored, out);
  return out;
}

Volume read_labels(const std::string &path, double unit) {
  return read_labels(path, cli::read_file(path, kMaxBytes + (1 << 20), "a label map"), unit);
}

}  // namespace labels
