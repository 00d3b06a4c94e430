# docs/reference/options.md must equal the output of `counterpoint generate markdown`.
execute_process(COMMAND ${COMMAND} generate markdown OUTPUT_VARIABLE made RESULT_VARIABLE result)
file(READ ${PAGE} kept)
if(NOT result EQUAL 0 OR NOT made STREQUAL kept)
  message(FATAL_ERROR "${PAGE} is not what the command says: counterpoint generate markdown > docs/reference/options.md")
endif()
