// What the tests of files share: a folder of their own, messages of errors, bytes.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <string>

#include "framework/error.hpp"
#include "framework/io/output_file.hpp"
#include "support/file_test.hpp"
#include "support/message_of.hpp"

namespace halfgrad {

template <class T>
std::string bytes(std::initializer_list<T> values) {
  return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(T)};
}

}  // namespace halfgrad
