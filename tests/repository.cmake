# What holds for the repository as a whole. Tests that build something carry the label "build" and are left out of the
# sanitizer run.
add_test(NAME layering COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/layering.sh ${PROJECT_SOURCE_DIR})
add_test(NAME layering_finds_violations COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/layering_test.sh)
# Links between the repository's pages.
add_test(NAME links COMMAND /usr/bin/python3 ${CMAKE_CURRENT_SOURCE_DIR}/docs/links_test.py ${PROJECT_SOURCE_DIR})

# Every header compiles alone. A source includes the header of its name first (layering.sh), so its build shows it; for
# the others the test builds a translation unit each.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     ${PROJECT_SOURCE_DIR}/elements/*.hpp ${PROJECT_SOURCE_DIR}/framework/*.hpp
     ${PROJECT_SOURCE_DIR}/reconstruction/*.hpp ${PROJECT_SOURCE_DIR}/experiments/*.hpp)
set(header_sources)
foreach(header IN LISTS headers)
  string(REGEX REPLACE "hpp$" "cpp" own_source ${header})
  if(EXISTS ${PROJECT_SOURCE_DIR}/${own_source})
    continue()
  endif()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/headers/${header}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n" @ONLY)
  list(APPEND header_sources ${source})
endforeach()
add_library(headers_alone OBJECT EXCLUDE_FROM_ALL ${header_sources})
target_link_libraries(headers_alone PRIVATE halfgrad::halfgrad halfgrad_build_flags)
target_compile_options(headers_alone PRIVATE -O0 -g0)
add_test(NAME headers_compile_alone
         COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target headers_alone)

# An element that lacks a member is refused by a message that names it.
get_target_property(eigen_directory Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
add_test(NAME missing_element_member_is_named
         COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/compile_fail/run.sh ${CMAKE_CXX_COMPILER} ${PROJECT_SOURCE_DIR}
                 -isystem ${eigen_directory})

# The README's example builds against an installed halfgrad and prints what the README says.
add_test(NAME install_consumer
         COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/install_consumer/run.sh ${PROJECT_BINARY_DIR}
                 ${PROJECT_SOURCE_DIR}/README.md)

# The projects below examples/, each against an installed halfgrad.
add_test(NAME examples
         COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/examples.sh ${PROJECT_BINARY_DIR} ${PROJECT_SOURCE_DIR}/examples)

set_tests_properties(headers_compile_alone missing_element_member_is_named install_consumer examples
                     PROPERTIES LABELS build)

# The report in a browser, where there is one.
if(TARGET halfgrad_program AND HALFGRAD_NODE)
  add_test(NAME report_page
           COMMAND ${HALFGRAD_NODE} ${CMAKE_CURRENT_SOURCE_DIR}/report_page/check.mjs $<TARGET_FILE:halfgrad_program>
                   ${PROJECT_SOURCE_DIR}/configs/sequence_cylinder.json ${CMAKE_CURRENT_BINARY_DIR}/report_page)
  set_tests_properties(report_page PROPERTIES SKIP_RETURN_CODE 77 LABELS build)
endif()
