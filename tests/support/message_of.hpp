// What an error says.
#pragma once

#include <string>
#include <utility>

#include "framework/error.hpp"

namespace halfgrad {

/// The message of the Error that f throws, or "no error".
template <class Function>
std::string message_of(Function&& f) {
  try {
    std::forward<Function>(f)();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace halfgrad
