// Writing pictures with OpenImageIO; picture_read.cpp reads them.
#include "io/pictures/pictures.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "core/embedded.hpp"
#include "core/error.hpp"
#include "io/pictures/picture_formats.hpp"
#include "io/whole_file.hpp"

namespace parian::pictures {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, std::string what, const char* remedy) {
  while (!what.empty() && (what.back() == '\n' || what.back() == ' ')) what.pop_back();
  std::replace(what.begin(), what.end(), '\n', ' ');
  throw Error(ErrorKind::output, fmt::format("{}: {}; {}", path.string(), what, remedy));
}

/// Where writers write. It remembers a failure and pretends to go on: told of a full disk, some codecs print, and
/// libjpeg ends the process.
class PatientFile : public OIIO::Filesystem::IOProxy {
 public:
  explicit PatientFile(const std::filesystem::path& path)
      : IOProxy(path.string(), IOProxy::Write),
        handle_(::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)),
        error_(handle_ < 0 ? errno : 0) {}
  ~PatientFile() override {
    if (handle_ >= 0) ::close(handle_);
  }
  PatientFile(const PatientFile&) = delete;
  PatientFile& operator=(const PatientFile&) = delete;

  const char* proxytype() const override { return "patient"; }
  size_t write(const void* bytes, size_t count) override {
    pwrite(bytes, count, m_pos);
    m_pos += static_cast<std::int64_t>(count);
    return count;
  }
  size_t pwrite(const void* bytes, size_t count, std::int64_t offset) override {
    size_ = std::max(size_, static_cast<size_t>(offset) + count);
    for (size_t done = 0; done < count && error_ == 0;) {
      const ssize_t part =
          ::pwrite(handle_, static_cast<const char*>(bytes) + done, count - done, offset + static_cast<off_t>(done));
      if (part > 0) done += static_cast<size_t>(part);
      if (part < 0 && errno != EINTR) error_ = errno;
    }
    return count;
  }
  size_t read(void* bytes, size_t count) override {
    const size_t got = pread(bytes, count, m_pos);
    m_pos += static_cast<std::int64_t>(got);
    return got;
  }
  size_t pread(void* bytes, size_t count, std::int64_t offset) override {
    const ssize_t got = error_ ? 0 : ::pread(handle_, bytes, count, offset);
    return got > 0 ? static_cast<size_t>(got) : 0;
  }
  size_t size() const override { return size_; }
  /// errno of the first failure, or 0.
  [[nodiscard]] int failure() const { return error_; }

 private:
  int handle_;
  int error_;
  size_t size_ = 0;
};

std::unique_ptr<OIIO::ImageOutput> writer_for(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  if (extension.empty() || extension == ".") {
    fail(path, "the name has no extension to say the format", "end it in .exr or .png");
  }
  extension.erase(0, 1);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  auto output = extension == "null" || extension == "term" ? nullptr : OIIO::ImageOutput::create(extension);
  (void)OIIO::geterror();  // OpenImageIO keeps the message until it's asked for
  if (!output || !format_of(*output))
    fail(path, fmt::format("'.{}' is no picture format that can be written", extension), "use .exr or .png");
  return output;
}

/// SOURCE_DATE_EPOCH as EXIF writes dates, else the start of 1970.
std::string date_time() {
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  std::time_t seconds = 0;
  if (epoch) {
    if (const auto number = parse_number(epoch); number && *number >= 0 && *number < 253402300800.0) {
      seconds = static_cast<std::time_t>(*number);
    }
  }
  std::tm date{};
  gmtime_r(&seconds, &date);
  return fmt::format("{:04}:{:02}:{:02} {:02}:{:02}:{:02}", date.tm_year + 1900, date.tm_mon + 1, date.tm_mday,
                     date.tm_hour, date.tm_min, date.tm_sec);
}

float srgb(float linear) {
  if (!(linear > 0)) return 0;  // NaN too
  if (linear >= 1) return 1;
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

std::uint8_t byte(float share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(std::isnan(share) ? 0.0f : share, 0.0f, 1.0f)));
}

/// Tone-mapped bytes: unassociated with alpha, over black without.
std::vector<std::uint8_t> tone_mapped(const Image& image, int channels, double stops) {
  const float gain = std::exp2(static_cast<float>(stops));
  const std::size_t pixels = image.rgba.size() / 4;
  std::vector<std::uint8_t> bytes(pixels * channels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* from = &image.rgba[4 * i];
    std::uint8_t* to = &bytes[i * channels];
    const float scale = channels < 4 ? gain : from[3] > 0 ? gain / from[3] : 0;
    for (int c = 0; c < 3; ++c) to[c] = byte(srgb(scale * from[c]));
    if (channels == 4) to[3] = byte(from[3]);
  }
  return bytes;
}

/// Pixels with `channels` values each: RGB, then alpha if there are four or seven, then the standard error if seven.
std::vector<float> interleaved(const Image& image, int channels) {
  std::vector<float> values;
  const std::size_t pixels = image.rgba.size() / 4;
  values.reserve(pixels * channels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto rgba = image.rgba.begin() + static_cast<std::ptrdiff_t>(4 * i);
    values.insert(values.end(), rgba, rgba + std::min(channels, 4));
    if (channels < 7) continue;
    const auto error = image.standard_error.begin() + static_cast<std::ptrdiff_t>(3 * i);
    values.insert(values.end(), error, error + 3);
  }
  return values;
}

OIIO::ImageSpec spec_for(const Image& image, int channels, OIIO::TypeDesc type, const PictureNotes& notes,
                         double stops) {
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels, type);
  spec.attribute("Software", fmt::format("parian {}", version));
  spec.attribute("DateTime", date_time());
  if (!notes.device.empty()) spec.attribute("parian:device", notes.device);
  spec.attribute("parian:settings", notes.settings);
  const bool floats = type == OIIO::TypeFloat;
  const auto number = [&](const char* name, double value) {  // PNG keeps text only
    floats ? spec.attribute(name, static_cast<float>(value)) : spec.attribute(name, fmt::format("{:.7g}", value));
  };
  if (notes.frames > 0) spec.attribute("parian:frames", fmt::format("{}", notes.frames));
  if (notes.estimated_relmse >= 0) number("parian:estimated_relmse", notes.estimated_relmse);
  for (const auto& [name, text] : notes.other) spec.attribute("parian:" + name, text);
  if (floats) {
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", "zip");
  } else {
    spec.attribute("oiio:ColorSpace", "sRGB");
    number("parian:exposure", stops);
    if (channels == 4) spec.attribute("oiio:UnassociatedAlpha", 1);
  }
  return spec;
}

}  // namespace

void check_format(const std::filesystem::path& path, glm::uvec2 film) {
  const Format& format = *format_of(*writer_for(path));
  if (film == glm::uvec2(0)) return;
  if (std::max(film.x, film.y) > format.largest_side)
    fail(path, fmt::format("this format has at most {0} x {0} pixels", format.largest_side), "use .exr or .png");
  if (std::min(film.x, film.y) < format.least_side)
    fail(path, fmt::format("this format has at least {0} x {0} pixels", format.least_side), "use .exr or .png");
}

std::string png_base64(const Image& image, double stops) {
  constexpr int channels = 4;
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels, OIIO::TypeUInt8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("DateTime", date_time());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = writer_for("memory.png");
  output->set_ioproxy(&memory);
  const std::vector<std::uint8_t> pixels = tone_mapped(image, channels, stops);
  if (!output->open("memory.png", spec) || !output->write_image(OIIO::TypeUInt8, pixels.data()) || !output->close()) {
    fail("PNG", "could not be made: " + output->geterror(), "check the installation of OpenImageIO");
  }
  return OIIO::Strutil::base64_encode({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void write(const std::filesystem::path& path, const Image& image, const PictureNotes& notes, const Exposure& exposure) {
  WholeFile file(path);
  std::unique_ptr<PatientFile> patient;  // outlives the writer, which closes itself when something throws
  const auto output = writer_for(path);
  const double stops = exposure.automatic ? automatic_stops(image) : exposure.stops;
  const Format& format = *format_of(*output);
  const bool errors = std::string_view(output->format_name()) == "openexr" && !image.standard_error.empty();
  const int channels = errors ? 7 : output->supports("alpha") ? 4 : 3;
  OIIO::ImageSpec spec = spec_for(image, channels, format.floats ? OIIO::TypeFloat : OIIO::TypeUInt8, notes, stops);
  if (errors) spec.channelnames = {"R", "G", "B", "A", "stderr.R", "stderr.G", "stderr.B"};
  if (errors) spec.alpha_channel = 3;
  if (output->supports("ioproxy")) {
    patient = std::make_unique<PatientFile>(file.temporary());
    output->set_ioproxy(patient.get());
  }
  if (!output->open(file.temporary().string(), spec)) {
    fail(path, "could not be opened: " + output->geterror(), "choose another name or format");
  }
  const std::vector<float> others =
      format.floats && channels != 4 ? interleaved(image, channels) : std::vector<float>();
  const std::vector<std::uint8_t> bytes =
      format.floats ? std::vector<std::uint8_t>() : tone_mapped(image, channels, stops);
  const float* floats = channels == 4 ? image.rgba.data() : others.data();
  const void* values = format.floats ? static_cast<const void*>(floats) : bytes.data();
  const bool written = output->write_image(format.floats ? OIIO::TypeFloat : OIIO::TypeUInt8, values);
  const std::string why = written ? std::string() : output->geterror();
  if (!output->close() || !written) {
    fail(path, "could not be written: " + (why.empty() ? output->geterror() : why),
         "free some space or choose another folder");
  }
  if (patient && patient->failure()) {
    fail(path, fmt::format("could not be written: {}", std::strerror(patient->failure())),
         "free some space or choose another folder");
  }
  if (!holds(file.temporary(), format, spec, values))
    fail(path, "could not be written in full", "free some space, choose another folder, or use .exr or .png");
  file.commit();
}

}  // namespace parian::pictures
