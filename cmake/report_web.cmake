# The script of the interactive report: bundled by npm's packages into report_script.cpp at build time where npm is there
# and works, else an empty one, with which the program writes static charts. Sets report_script_source.
option(HALFGRAD_WEB_REPORT "Bundle the interactive report with npm where it is found" ON)

set(web_source ${CMAKE_CURRENT_SOURCE_DIR}/report_web)
set(web_build ${CMAKE_CURRENT_BINARY_DIR}/report_web)
set(report_script_source ${web_build}/report_script.cpp)

set(static_reason "")
if(NOT HALFGRAD_WEB_REPORT)
  set(static_reason "HALFGRAD_WEB_REPORT is off")
else()
  find_program(HALFGRAD_NPM npm)
  find_program(HALFGRAD_NODE NAMES node nodejs)
  if(NOT HALFGRAD_NPM OR NOT HALFGRAD_NODE)
    set(static_reason "npm was not found")
  endif()
endif()

if(static_reason)
  message(STATUS "Report: static charts, because ${static_reason}")
  configure_file(${web_source}/no_script.cpp ${report_script_source} COPYONLY)
else()
  message(STATUS "Report: interactive, where npm can install its packages")
  file(GLOB web_scripts CONFIGURE_DEPENDS ${web_source}/src/*)
  add_custom_command(OUTPUT ${report_script_source}
                     COMMAND ${CMAKE_COMMAND} -Dnpm=${HALFGRAD_NPM} -Dnode=${HALFGRAD_NODE} -Dsource=${web_source}
                             -Dbuild=${web_build} -Doutput=${report_script_source}
                             -P ${PROJECT_SOURCE_DIR}/cmake/bundle_report.cmake
                     DEPENDS ${web_scripts} ${web_source}/package.json ${web_source}/package-lock.json
                             ${web_source}/build.mjs ${web_source}/no_script.cpp
                     COMMENT "Bundling the interactive report" VERBATIM)
endif()
