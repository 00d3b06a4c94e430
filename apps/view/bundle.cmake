# Packs page/ into program.cc. If node, npm or the package registry is missing, the program is empty
# and states the reason and the remedy; an error in page/ itself fails the build.
#   cmake -DNODE= -DNPM= -DPAGE= -DWORK= -DOUTPUT= -P bundle.cmake
function(go_on_without reason)
  message("The page of replays is not built: ${reason}. `counterpoint view` will say so.")
  file(WRITE ${OUTPUT} "// ${reason}\n#include \"view/program.h\"\nnamespace counterpoint::view {\n"
    "const char* program() { return \"\"; }\nconst char* program_missing() { return \"${reason}\"; }\n}\n")
endfunction()

set(install "install nodejs and npm (scripts/setup.sh does, Debian 12), then build again")
if(NOT NODE OR NOT NPM)
  go_on_without("node or npm was missing; ${install}")
  return()
endif()
execute_process(COMMAND ${NODE} --version OUTPUT_VARIABLE version OUTPUT_STRIP_TRAILING_WHITESPACE)
string(REGEX REPLACE "^v" "" version "${version}")
if(version VERSION_LESS 18)
  go_on_without("node ${version} is older than 18; ${install}")
  return()
endif()

file(MAKE_DIRECTORY ${WORK})
file(GLOB files ${PAGE}/*)
file(COPY ${files} DESTINATION ${WORK})
# The packages are fetched again only when the lock file changes.
file(SHA256 ${WORK}/package-lock.json lock)
set(stamp ${WORK}/node_modules/.lock-${lock})
if(NOT EXISTS ${stamp})
  # Without a registry npm's default number of retries would take more than a minute.
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
                          --fetch-retries=2 --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=5000
    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE words)
  if(failed)
    message("${words}")
    go_on_without("npm could not fetch its packages; with a network, touch apps/view/bundle.cmake and build again")
    return()
  endif()
  file(WRITE ${stamp} "")
endif()
execute_process(COMMAND ${NODE} ${WORK}/bundle.mjs ${WORK} ${OUTPUT} RESULT_VARIABLE failed)
if(failed)
  file(REMOVE ${OUTPUT})
  message(FATAL_ERROR "apps/view/page cannot be packed")
endif()
