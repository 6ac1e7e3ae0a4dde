#include "mesh/vtu_array.h"

#ifdef DEFORM_HAVE_ZLIB
#include <zlib.h>
#endif

#include <algorithm>
#include <span>

namespace dfm {
namespace {

// Unpacks into exactly `to.size()` bytes.
void unpack_block(const Cursor &in, std::string_view packed, std::span<char> to, uint64_t block) {
#ifdef DEFORM_HAVE_ZLIB
  uLongf bytes = static_cast<uLongf>(to.size());
  const int code =
      uncompress(reinterpret_cast<Bytef *>(to.data()), &bytes, reinterpret_cast<const Bytef *>(packed.data()),
                 static_cast<uLong>(packed.size()));
  if (code == Z_MEM_ERROR) throw std::bad_alloc();
  if (code != Z_OK || bytes != to.size())
    in.refuse("compressed block %llu is damaged (zlib says %d)", ull(block), code);
#else
  in.refuse("is compressed (block %llu is), and this library was built without zlib: write it uncompressed",
            ull(block));
#endif
}

// Limit on the unpacked bytes of an array relative to the bytes of the file: an array of types compresses a
// thousandfold, but coordinates and cells of a valid file vary. Second: the largest expansion of one byte by
// deflate.
constexpr uint64_t kMaxUnpacking = 64, kFreeUnpacking = 4096, kMaxDeflation = 1032;

// Bytes out of raw data or base64. White space is skipped; a padded group may be anywhere, as writers
// encode lengths and data apart.
class ByteSource {
 public:
  ByteSource(std::string_view data, bool base64) : data_(data), base64_(base64) {}

  uint64_t at_most() const {
    return base64_ ? uint64_t(data_.size() - at_) * 3 / 4 + held_ : data_.size() - at_;
  }
  std::string_view raw_rest() const { return data_.substr(at_); }

  // False where the data end before n bytes.
  bool read(char *out, size_t n) {
    if (!base64_) {
      if (data_.size() - at_ < n) return false;
      if (n) std::memcpy(out, data_.data() + at_, n);
      at_ += n;
      return true;
    }
    for (size_t i = 0; i < n; ++i) {
      if (held_ == 0 && !decode()) return false;
      out[i] = group_[used_++];
      --held_;
    }
    return true;
  }

 private:
  static int digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : c == '=' ? 64 : -1;
  }

  bool decode() {
    uint32_t bits = 0;
    int n = 0, padding = 0;
    while (n < 4) {
      if (at_ == data_.size()) return false;
      const char c = data_[at_];
      if (c == ' ' || c == '\n' || c == '\r' || c == '\t') {
        ++at_;
        continue;
      }
      const int d = digit(c);
      if (d < 0 || (padding && d != 64) || (d == 64 && n < 2)) return false;
      padding += d == 64;
      bits = bits << 6 | uint32_t(d & 63);
      ++at_;
      ++n;
    }
    group_[0] = static_cast<char>(bits >> 16);
    group_[1] = static_cast<char>(bits >> 8);
    group_[2] = static_cast<char>(bits);
    used_ = 0;
    held_ = 3 - padding;
    return held_ > 0;
  }

  std::string_view data_;
  size_t at_ = 0;
  bool base64_;
  char group_[3] = {};
  int used_ = 0, held_ = 0;
};

class Unpacker {
 public:
  Unpacker(const Cursor &in, const VtuPacking &packing, ByteSource source)
      : in_(in), packing_(packing), source_(source) {}

  // Raw data are used in place; other data are unpacked into `out`.
  std::string_view run(Array<char> &out, bool in_place) {
    const uint64_t first = length();
    if (packing_.compressed) return inflate_blocks(first, out);
    if (first > source_.at_most())
      in_.refuse(
          "promises %llu bytes, but the %llu left in the file cannot hold them: the file is truncated or its "
          "length is wrong",
          ull(first), ull(source_.at_most()));
    if (in_place) return source_.raw_rest().substr(0, size_t(first));
    out.resize(size_t(first));
    if (!source_.read(out.data(), out.size()))
      in_.refuse("the file ends, or is not base64, inside its %llu bytes", ull(first));
    return {out.data(), out.size()};
  }

 private:
  uint64_t length() {
    char raw[8];
    if (!source_.read(raw, packing_.header_bytes))
      in_.refuse("the file ends, or is not base64, inside the array's length");
    Cursor number(in_.path(), raw, packing_.header_bytes);
    number.swap = packing_.swap;
    return packing_.header_bytes == 8 ? number.value<uint64_t>("a length")
                                      : number.value<uint32_t>("a length");
  }

  // How many blocks, bytes of each but perhaps the last, bytes of the last where it is shorter, packed
  // bytes of each.
  std::string_view inflate_blocks(uint64_t nblock, Array<char> &out) {
    if (nblock > source_.at_most() / packing_.header_bytes)
      in_.refuse("promises %llu blocks, for which the file is too short", ull(nblock));
    const uint64_t size = length(), last = length(), packed_left = source_.at_most();
    const uint64_t most = kFreeUnpacking + kMaxUnpacking * packing_.file_bytes;
    if (size > most || last > size || (nblock && size > most / nblock))
      in_.refuse(
          "promises %llu blocks of %llu bytes, but the %llu packed bytes left in the file cannot hold them",
          ull(nblock), ull(size), ull(packed_left));
    Array<uint64_t> packed(size_t(nblock), *out.get_allocator().memory);
    for (uint64_t &p : packed) {
      p = length();
      if (p > packed_left || (&p != &packed.back() && size > kMaxDeflation * (p + 1)))
        in_.refuse("compressed block %zu has %llu bytes where %llu are left, for %llu",
                   size_t(&p - packed.data()), ull(p), ull(packed_left), ull(size));
    }
    const uint64_t total = nblock == 0 ? 0 : size * (nblock - 1) + (last ? last : size);
    out.resize(size_t(total));
    Array<char> block(*out.get_allocator().memory);
    for (uint64_t b = 0; b < nblock; ++b) {
      if (packed[b] > source_.at_most()) in_.refuse("the file ends inside compressed block %llu", ull(b));
      block.resize(size_t(packed[b]));
      if (!source_.read(block.data(), block.size()))
        in_.refuse("the file ends, or is not base64, inside compressed block %llu", ull(b));
      const uint64_t bytes = b + 1 < nblock || last == 0 ? size : last;
      unpack_block(in_, {block.data(), block.size()}, {out.data() + size * b, size_t(bytes)}, b);
    }
    return {out.data(), out.size()};
  }

  const Cursor &in_;
  const VtuPacking &packing_;
  ByteSource source_;
};

Number type_called(const Cursor &in, std::string_view name) {
  static const std::pair<std::string_view, Number> known[] = {
      {"Float32", Number::f32},   {"Float64", Number::f64},  {"Int8", Number::i8},
      {"UInt8", Number::u8},      {"Int16", Number::i16},    {"UInt16", Number::u16},
      {"Int32", Number::i32},     {"UInt32", Number::u32},   {"Int64", Number::i64},
      {"UInt64", Number::u64},    {"String", Number::text},  {"Bit", Number::bit},
      {"VTKIdType", Number::i64}, {"vtkIdType", Number::i64}};
  for (const auto &[text, type] : known)
    if (text == name) return type;
  in.refuse("a DataArray of type %s; expected Float64, Float32, Int32, Int64, UInt8 ...",
            Cursor::quote(name.empty() ? " " : name).c_str());
}

}  // namespace

std::string_view XmlTag::get(std::string_view key) const {
  for (std::string_view rest = attributes;;) {
    const size_t from = rest.find_first_not_of(" \t\r\n"), equals = rest.find('=');
    if (from == rest.npos || equals == rest.npos || equals < from) return {};
    std::string_view found = rest.substr(from, equals - from);
    found = found.substr(0, found.find_first_of(" \t\r\n"));
    const size_t open = rest.find_first_of("\"'", equals);
    if (open == rest.npos) return {};
    const size_t close = rest.find(rest[open], open + 1);
    if (close == rest.npos) return {};
    if (found == key) return rest.substr(open + 1, close - open - 1);
    rest.remove_prefix(close + 1);
  }
}

std::optional<XmlTag> next_tag(Cursor &in) {
  for (;;) {
    if (!in.find("<")) return {};
    std::string_view rest = in.rest();
    const bool comment = rest.substr(0, 4) == "<!--";
    if (comment || rest.substr(0, 2) == "<?" || rest.substr(0, 2) == "<!") {
      if (!in.find(comment ? "-->" : ">"))
        in.refuse("an XML %s has no end", comment ? "comment" : "declaration");
      in.skip(1, "a tag");
      continue;
    }
    size_t end = 0;
    for (char quote = 0; end < rest.size() && (quote || rest[end] != '>'); ++end)
      if (rest[end] == quote) quote = 0;
      else if (!quote && (rest[end] == '"' || rest[end] == '\'')) quote = rest[end];
    if (end == rest.size()) in.refuse("an XML tag has no end: the file is truncated");
    rest = rest.substr(1, end - 1);
    XmlTag tag;
    tag.closes = !rest.empty() && rest.front() == '/';
    if (tag.closes) rest.remove_prefix(1);
    tag.empty = !rest.empty() && rest.back() == '/';
    if (tag.empty) rest.remove_suffix(1);
    tag.name = rest.substr(0, rest.find_first_of(" \t\r\n"));
    tag.attributes = rest.substr(tag.name.size());
    in.skip(end + 1, "a tag");
    return tag;
  }
}

VtuPlace vtu_place(Cursor &in, const XmlTag &tag) {
  VtuPlace place;
  place.given = true;
  place.type = type_called(in, tag.get("type"));
  place.name = std::string(tag.get("Name").substr(0, 64));
  place.format = vtk_lower(tag.get("format"));
  if (place.format.empty()) place.format = "ascii";
  const auto number = [&](const char *key) {
    const std::string_view text = tag.get(key);
    return text.empty() ? int64_t(0) : Cursor(in).to_integer(text, key);
  };
  const int64_t components = number("NumberOfComponents"), offset = number("offset");
  if (components < 0 || components > 64 || offset < 0)
    in.refuse("a DataArray with %lld components at offset %lld", ll(components), ll(offset));
  place.components = std::max(1u, static_cast<uint32_t>(components));
  place.offset = static_cast<uint64_t>(offset);
  if (tag.empty) return place;
  // Numbers come before the first tag inside; information keys may follow.
  for (;;) {
    if (place.text.empty()) place.text = in.rest().substr(0, in.rest().find('<'));
    if (place.text.find_first_not_of(" \t\r\n") == place.text.npos) place.text = {};
    const auto inner = next_tag(in);
    if (!inner)
      in.refuse("DataArray %s has no end: the file is truncated",
                Cursor::quote(place.name.empty() ? " " : place.name).c_str());
    if (inner->closes && inner->name == "DataArray") return place;
  }
}

VtuNumbers::VtuNumbers(const Memory &memory, const Cursor &file, const VtuPacking &packing,
                       const VtuPlace &place)
    : in(file), type(place.type), unpacked_(memory) {
  if (type == Number::text) type = Number::i8;
  if (bytes_of(type) == 0) file.unsupported("DataArray '%s' of bits is not read", place.name.c_str());
  if (place.format == "ascii") {
    const char *const begin = file.rest().data() - file.offset();
    in.seek(place.text.empty() ? file.offset() : size_t(place.text.data() - begin));
    in = in.part(place.text.size());
    return;
  }
  const bool appended = place.format == "appended";
  if (!appended && place.format != "binary")
    file.refuse("a DataArray of format %s; expected ascii, binary or appended",
                Cursor::quote(place.format).c_str());
  if (appended && packing.appended.empty())
    file.refuse("DataArray '%s' is appended, but the file has no AppendedData: it is truncated",
                place.name.c_str());
  if (appended && place.offset > packing.appended.size())
    file.refuse("DataArray '%s' at offset %llu, but AppendedData has %zu bytes", place.name.c_str(),
                ull(place.offset), packing.appended.size());
  const bool base64 = !appended || packing.appended_base64;
  const std::string name = file.path() + ", DataArray '" + place.name + "'";
  Cursor self(name, nullptr, 0);
  self.binary = true;
  Unpacker unpacker(
      self, packing,
      ByteSource(appended ? packing.appended.substr(size_t(place.offset)) : place.text, base64));
  const std::string_view bytes = unpacker.run(unpacked_, !base64);
  in = Cursor(name, bytes.data(), bytes.size());
  in.binary = true;
  in.swap = packing.swap;
}

void VtuNumbers::expect(uint64_t n, const char *what) {
  in.count(static_cast<int64_t>(std::min<uint64_t>(n, INT64_MAX)), 1, type, what);
}

}  // namespace dfm
