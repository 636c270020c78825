// Base64, as XML files hold binary data.
#pragma once

#include <string>
#include <string_view>

namespace halfgrad {

/// The bytes of a text, up to its end, the first character that is none of base64's, or some more than `enough` bytes.
/// White space is skipped. Several encoded streams in a row, each padded by itself, give their bytes in a row.
std::string decode_base64(std::string_view text, std::size_t enough);

}  // namespace halfgrad
