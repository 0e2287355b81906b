/* OpenImageIO behind a C header. Its exceptions end here. */
#include "io/image.h"

#include "io/file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <zlib.h>

namespace
{

constexpr size_t FILE_LIMIT_BYTES = size_t{ 1 } << 32, DESCRIPTION_LIMIT_BYTES = size_t{ 1 } << 16;

/* 0..1 to 0..255; NaN is black. */
unsigned char byte_from_unit(double value)
{
    const double clamped = value > 0.0 ? std::fmin(value, 1.0) : 0.0;
    return static_cast<unsigned char>(std::floor(clamped * 255.0 + 0.5));
}

std::vector<unsigned char> encode(const io_image &image)
{
    const size_t channels = static_cast<size_t>(image.channel_count);
    const size_t count = static_cast<size_t>(image.width_px) * static_cast<size_t>(image.height_px);
    const size_t colours = channels == 4 ? 3 : channels;
    std::vector<unsigned char> bytes(count * channels);
    for (size_t i = 0; i < count; i++) {
        const float *in = image.pixels + i * channels;
        unsigned char *out = bytes.data() + i * channels;
        const double alpha = channels == 4 ? std::fmin(std::fmax(in[3], 0.0), 1.0) : 1.0;
        for (size_t c = 0; c < colours; c++) {
            const double linear = alpha > 0.0 ? in[c] / alpha : 0.0;
            out[c] = byte_from_unit(io_srgb_from_linear(linear));
        }
        if (channels == 4)
            out[3] = byte_from_unit(alpha);
    }
    return bytes;
}

/* Numbers and texts of the image, "name=value" by lines: a PNG's description. */
std::string describe(const io_image &image)
{
    std::string text;
    for (size_t i = 0; i < image.attribute_count; i++) {
        const io_attribute &attribute = image.attributes[i];
        char number[96];
        if (attribute.kind == IO_ATTRIBUTE_NUMBERS)
            std::snprintf(number, sizeof number, "%.17g %.17g %.17g", attribute.numbers[0],
                          attribute.numbers[1], attribute.numbers[2]);
        else
            std::snprintf(number, sizeof number, "%.17g", attribute.numbers[0]);
        text += attribute.name;
        text += '=';
        text += attribute.kind == IO_ATTRIBUTE_TEXT ? attribute.text : number;
        text += '\n';
    }
    return text.size() <= DESCRIPTION_LIMIT_BYTES ? text : std::string();
}

/* How many numbers, up to three, the text consists of; 0 if it is anything else. */
size_t numbers_in(const std::string &text, double numbers[3])
{
    const char *at = text.c_str();
    size_t count = 0;
    while (*at != '\0' && count < 3) {
        char *rest = nullptr;
        numbers[count] = std::strtod(at, &rest);
        if (rest == at || !std::isfinite(numbers[count]))
            return 0;
        count++;
        at = rest + (*rest == ' ' ? 1 : 0);
    }
    return *at == '\0' ? count : 0;
}

/* The same back; what is not of that form is left alone. */
void take_description(const std::string &text, io_image &image)
{
    if (text.size() > DESCRIPTION_LIMIT_BYTES)
        return;
    size_t start = 0;
    while (start < text.size()) {
        const size_t end = std::min(text.find('\n', start), text.size());
        const std::string line = text.substr(start, end - start);
        const size_t equals = line.find('=');
        start = end + 1;
        if (line.compare(0, 7, "dipole:") != 0 || equals == std::string::npos)
            continue;
        const std::string name = line.substr(0, equals), value = line.substr(equals + 1);
        double numbers[3];
        const size_t count = numbers_in(value, numbers);
        if (count == 1)
            io_image_set_number(&image, name.c_str(), numbers[0]);
        else if (count == 3)
            io_image_set_numbers(&image, name.c_str(), numbers);
        else
            io_image_set_text(&image, name.c_str(), value.c_str());
    }
}

/* place (may be NULL) is what messages name. */
bool encode_png(const io_image &image, const dipole_place *place, std::vector<unsigned char> &file,
                dipole_status *status)
{
    const std::vector<unsigned char> bytes = encode(image);
    OIIO::Filesystem::IOVecOutput stream(file);
    OIIO::ImageSpec spec(image.width_px, image.height_px, image.channel_count, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    const std::string description = describe(image);
    if (!description.empty())
        spec.attribute("ImageDescription", description);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("png");
    if (!output)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, place, "cannot be written as PNG: %s",
                           OIIO::geterror().c_str());
    if (!output->set_ioproxy(&stream) || !output->open("png", spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, bytes.data()) || !output->close())
        return dipole_fail(status, DIPOLE_IO_FAILED, place, "cannot be written as PNG: %s",
                           output->geterror().c_str());
    return true;
}

bool write_png(const char *path, const io_image &image, dipole_status *status)
{
    const dipole_place place = { path, 0, 0 };
    std::vector<unsigned char> file;
    return encode_png(image, &place, file, status) && io_file_write(path, file.data(), file.size(), status);
}

bool copy_png(const io_image &image, unsigned char **bytes_out, size_t *size_out, dipole_status *status)
{
    std::vector<unsigned char> file;
    if (!encode_png(image, nullptr, file, status))
        return false;
    auto *const bytes = static_cast<unsigned char *>(std::malloc(file.size()));
    if (!bytes)
        throw std::bad_alloc();
    std::memcpy(bytes, file.data(), file.size());
    *bytes_out = bytes;
    *size_out = file.size();
    return true;
}

/* Integers are sRGB with alpha beside the colour; what is in memory is linear and premultiplied. */
void decode(io_image &image, bool is_srgb, bool is_unassociated)
{
    const size_t channels = static_cast<size_t>(image.channel_count);
    const size_t count = static_cast<size_t>(image.width_px) * static_cast<size_t>(image.height_px);
    const size_t colours = channels == 4 ? 3 : channels;
    for (size_t i = 0; i < count; i++) {
        float *pixel = image.pixels + i * channels;
        for (size_t c = 0; c < colours; c++) {
            double value = is_srgb ? io_linear_from_srgb(pixel[c]) : pixel[c];
            if (is_unassociated && channels == 4)
                value *= pixel[3];
            pixel[c] = static_cast<float>(value);
        }
    }
}

unsigned long big_endian(const char *data)
{
    unsigned long value = 0;
    for (int i = 0; i < 4; i++)
        value = value << 8 | static_cast<unsigned char>(data[i]);
    return value;
}

/* Where a PNG is damaged or ends too early; 0 when it is whole, or no PNG. */
size_t png_damage(const char *data, size_t size)
{
    static const char signature[] = "\x89PNG\r\n\x1a\n";
    if (size < 8 || std::memcmp(data, signature, 8) != 0)
        return 0;
    size_t at = 8;
    while (size - at >= 12) { /* length, name, content, checksum of name and content */
        const unsigned long length = big_endian(data + at);
        if (length > size - at - 12)
            break;
        const unsigned long checksum =
            crc32(0, reinterpret_cast<const Bytef *>(data + at + 4), static_cast<uInt>(length + 4));
        if (checksum != big_endian(data + at + 8 + length))
            break;
        if (std::memcmp(data + at + 4, "IEND", 4) == 0)
            return 0;
        at += 12 + length;
    }
    return at;
}

/* Fail unless the file can be read. libpng prints what it thinks of a damaged file, so damage is found
 * first. */
bool check_file(const char *path, dipole_status *status)
{
    char *data = nullptr;
    size_t size = 0;
    if (!io_file_read(path, FILE_LIMIT_BYTES, &data, &size, status))
        return false;
    const size_t damage = png_damage(data, size);
    std::free(data);
    const dipole_place place = { path, 0, 0 };
    return damage == 0 ||
           dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                       "cannot be read as an image: the PNG is damaged or cut at byte %zu of %zu", damage,
                       size);
}

bool read_photo(const char *path, io_photo_coding coding, io_photo_info *info_out, io_image **image_out,
                dipole_status *status)
{
    const dipole_place place = { path, 0, 0 };
    if (!check_file(path, status))
        return false;
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* else alpha is multiplied in before sRGB is undone */
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &hints);
    if (!input)
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "cannot be read as an image: %s",
                           OIIO::geterror().c_str());
    const OIIO::ImageSpec &spec = input->spec();
    if (spec.deep || spec.depth > 1)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                           "is deep or a volume, expected a flat image");
    const int channels = spec.nchannels < 3 ? 1 : spec.nchannels == 3 ? 3 : 4;
    const bool is_integer = !spec.format.is_floating_point();
    const bool is_srgb = is_integer && coding == IO_PHOTO_SRGB;
    const bool is_unassociated = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    io_image *image = nullptr;
    if (!io_image_create(spec.width, spec.height, channels, &image, status))
        return false;
    std::unique_ptr<io_image, void (*)(io_image *)> owner(image, io_image_destroy);
    if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, image->pixels))
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "cannot be read as an image: %s",
                           input->geterror().c_str());
    decode(*image, is_srgb, is_unassociated);
    take_description(spec.get_string_attribute("ImageDescription"), *image);
    if (info_out) {
        const int whole = static_cast<int>(8 * spec.format.size());
        const int bits = spec.get_int_attribute("oiio:BitsPerSample", whole);
        *info_out = io_photo_info{ is_integer ? bits : 0, is_srgb };
    }
    *image_out = owner.release();
    return true;
}

bool read_size(const char *path, int *width_px, int *height_px, dipole_status *status)
{
    const dipole_place place = { path, 0, 0 };
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path);
    if (!input)
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "cannot be read as an image: %s",
                           OIIO::geterror().c_str());
    *width_px = input->spec().width;
    *height_px = input->spec().height;
    return true;
}

/* Run work; what it throws becomes a status. */
template <typename Work> bool guarded(const char *path, dipole_status *status, Work work)
{
    const dipole_place place = { path, 0, 0 };
    try {
        return work();
    } catch (const std::bad_alloc &) {
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for this image");
    } catch (const std::exception &problem) {
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "OpenImageIO failed: %s", problem.what());
    } catch (...) {
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "OpenImageIO failed, expected it to say why");
    }
}

} // namespace

bool io_png_write(const char *path, const io_image *image, dipole_status *status)
{
    return guarded(path, status, [&] { return write_png(path, *image, status); });
}

bool io_png_encode(const io_image *image, unsigned char **bytes_out, size_t *size_out,
                   dipole_status *status)
{
    *bytes_out = nullptr;
    *size_out = 0;
    return guarded(nullptr, status, [&] { return copy_png(*image, bytes_out, size_out, status); });
}

bool io_photo_read(const char *path, io_photo_coding coding, io_photo_info *info_out, io_image **image_out,
                   dipole_status *status)
{
    *image_out = nullptr;
    return guarded(path, status, [&] { return read_photo(path, coding, info_out, image_out, status); });
}

bool io_photo_size(const char *path, int *width_px, int *height_px, dipole_status *status)
{
    return guarded(path, status, [&] { return read_size(path, width_px, height_px, status); });
}

double io_srgb_from_linear(double linear)
{
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double io_linear_from_srgb(double srgb)
{
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
