# The script of the interactive report: bundled by npm's packages into report_script.cpp where npm is there and works,
# else an empty one, with which the program writes static charts. Sets report_script_source.
option(HALFGRAD_WEB_REPORT "Bundle the interactive report with npm where it is found" ON)

set(web_source ${CMAKE_CURRENT_SOURCE_DIR}/report_web)
set(web_build ${CMAKE_CURRENT_BINARY_DIR}/report_web)
set(report_script_source ${web_build}/report_script.cpp)
foreach(file package.json package-lock.json build.mjs)
  configure_file(${web_source}/${file} ${web_build}/${file} COPYONLY)
endforeach()

set(static_reason "")
if(NOT HALFGRAD_WEB_REPORT)
  set(static_reason "HALFGRAD_WEB_REPORT is off")
else()
  find_program(HALFGRAD_NPM npm)
  find_program(HALFGRAD_NODE NAMES node nodejs)
  if(NOT HALFGRAD_NPM OR NOT HALFGRAD_NODE)
    set(static_reason "npm was not found")
  else()
    # The packages of the lock file, installed once: no package's own script runs.
    file(SHA256 ${web_build}/package-lock.json wanted)
    set(installed "")
    if(EXISTS ${web_build}/installed.txt)
      file(READ ${web_build}/installed.txt installed)
    endif()
    if(NOT installed STREQUAL wanted)
      message(STATUS "Report: installing the packages of experiments/report_web/package-lock.json")
      execute_process(COMMAND ${HALFGRAD_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
                      WORKING_DIRECTORY ${web_build} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE complaint)
      if(failed)
        set(static_reason "npm ci failed: ${complaint}")
      else()
        file(WRITE ${web_build}/installed.txt ${wanted})
      endif()
    endif()
  endif()
endif()

if(static_reason)
  message(STATUS "Report: static charts, because ${static_reason}")
  configure_file(${web_source}/no_script.cpp ${report_script_source} COPYONLY)
else()
  message(STATUS "Report: interactive")
  file(GLOB web_scripts CONFIGURE_DEPENDS ${web_source}/src/*)
  add_custom_command(OUTPUT ${report_script_source}
                     COMMAND ${HALFGRAD_NODE} ${web_build}/build.mjs ${web_source}/src ${report_script_source}
                     DEPENDS ${web_scripts} ${web_build}/build.mjs ${web_build}/installed.txt
                     COMMENT "Bundling the interactive report" VERBATIM)
endif()
