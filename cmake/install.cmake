# What is installed: the library with its headers, the experiments where they are built, the program, and the package that find_package(halfgrad) reads.
include(CMakePackageConfigHelpers)

set(package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/halfgrad)

install(TARGETS halfgrad EXPORT halfgradTargets)
install(DIRECTORY elements framework reconstruction DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halfgrad
        FILES_MATCHING PATTERN "*.hpp")
# The contracts of elements and reconstructors as test suites, for those of other projects.
install(DIRECTORY tests/contracts tests/support DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halfgrad/tests
        FILES_MATCHING PATTERN "*.hpp" PATTERN "shared_data.hpp" EXCLUDE)
if(TARGET halfgrad_experiments)
  set_target_properties(halfgrad_experiments PROPERTIES EXPORT_NAME experiments)
  install(TARGETS halfgrad_experiments EXPORT halfgradTargets)
  install(DIRECTORY experiments DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/halfgrad FILES_MATCHING PATTERN "*.hpp")
endif()
install(EXPORT halfgradTargets NAMESPACE halfgrad:: DESTINATION ${package_directory})
configure_package_config_file(cmake/halfgradConfig.cmake.in ${PROJECT_BINARY_DIR}/halfgradConfig.cmake
                              INSTALL_DESTINATION ${package_directory})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/halfgradConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/halfgradConfig.cmake ${PROJECT_BINARY_DIR}/halfgradConfigVersion.cmake
        DESTINATION ${package_directory})
