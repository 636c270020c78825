# What is installed of the library: its public headers and the package that find_package(halfgrad) reads; and how all of it
# becomes Debian packages. apps/ installs the program.
include(CMakePackageConfigHelpers)

set(package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/halfgrad)
set(header_directory ${CMAKE_INSTALL_INCLUDEDIR}/halfgrad)

install(TARGETS halfgrad EXPORT halfgradTargets COMPONENT development)
# All but what only sources of the library include; a test compiles the rest against an installed prefix.
install(DIRECTORY elements framework reconstruction DESTINATION ${header_directory} COMPONENT development
        FILES_MATCHING PATTERN "*.hpp"
        PATTERN "framework/io" EXCLUDE
        PATTERN "framework/kernels/formulas.hpp" EXCLUDE
        PATTERN "framework/kernels/targets.hpp" EXCLUDE
        REGEX "framework/(boundary_facets|cell_locator|nearest_cell|plane_margins|interpolant_binding)[.]hpp$" EXCLUDE
        REGEX "reconstruction/(kriging_system|symmetric_eigen)[.]hpp$" EXCLUDE)
foreach(header frame_sink frame_source geometry mesh_file npy point_set vtk_output)
  install(FILES framework/io/${header}.hpp DESTINATION ${header_directory}/framework/io COMPONENT development)
endforeach()
# The contracts of elements and reconstructors as test suites, for those of other projects.
install(DIRECTORY tests/contracts tests/support DESTINATION ${header_directory}/tests COMPONENT development
        FILES_MATCHING PATTERN "*.hpp" PATTERN "shared_data.hpp" EXCLUDE)
if(TARGET halfgrad_experiments)
  set_target_properties(halfgrad_experiments PROPERTIES EXPORT_NAME experiments)
  install(TARGETS halfgrad_experiments EXPORT halfgradTargets COMPONENT development)
  install(DIRECTORY experiments DESTINATION ${header_directory} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
endif()
install(EXPORT halfgradTargets NAMESPACE halfgrad:: DESTINATION ${package_directory} COMPONENT development)
configure_package_config_file(cmake/halfgradConfig.cmake.in ${PROJECT_BINARY_DIR}/halfgradConfig.cmake
                              INSTALL_DESTINATION ${package_directory})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/halfgradConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/halfgradConfig.cmake ${PROJECT_BINARY_DIR}/halfgradConfigVersion.cmake
        DESTINATION ${package_directory} COMPONENT development)

foreach(package "halfgrad program" "libhalfgrad-dev development")
  separate_arguments(words UNIX_COMMAND "${package}")
  list(POP_FRONT words name component)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} RENAME copyright COMPONENT ${component})
endforeach()

# Debian packages: cpack in the build directory, after a build of all.
set(CPACK_PACKAGE_CONTACT "The halfgrad authors <noreply@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME halfgrad)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The halfgrad program: carries points through sequences of deformed meshes,
 exports the map for other programs, and measures interpolants.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libhalfgrad-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The library with its headers, for find_package(halfgrad).")
# The packages of what halfgradConfig.cmake looks for.
string(JOIN ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)" libfmt-dev nlohmann-json3-dev
       libtbb-dev libhwy-dev libfast-float-dev libpugixml-dev zlib1g-dev)
include(CPack)
