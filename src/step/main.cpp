// bisector-step: the surfaces of a segmentation as STEP or IGES.
#include <fmt/format.h>
#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <TCollection_HAsciiString.hxx>
#include <gp_Pnt.hxx>
#include <gp_Trsf.hxx>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "io/files.h"
#include "step/command_line.h"
#include "step/shell.h"
#include "step/trims.h"

namespace {

using namespace bisector;
using namespace bisector::step;

bool is_iges(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".igs" || extension == ".iges") return true;
  if (extension == ".stp" || extension == ".step") return false;
  throw Error(fmt::format("{}: unknown format '{}'; use .step, .stp, .iges or .igs", path, extension));
}

const Unit& unit_of(const std::string& word) {
  for (const Unit& unit : kUnits)
    if (word == unit.word) return unit;
  throw Error(fmt::format("the unit {} is unknown", word));
}

// Coordinates are written as they are, with the name of their unit: OpenCASCADE, which takes shapes to be in
// millimetres, converts them. Dates are fixed, so that the same shape gives the same bytes. False if OpenCASCADE cannot
// do it.
bool print_shape(const TopoDS_Shape& given, bool iges, const Unit& unit, std::ostream& out) {
  gp_Trsf scaling;
  scaling.SetScale(gp_Pnt(), unit.millimetres);
  const TopoDS_Shape shape = unit.millimetres == 1 ? given : BRepBuilderAPI_Transform(given, scaling, true).Shape();
  if (iges) {
    IGESControl_Controller::Init();
    IGESControl_Writer writer(unit.name, 1);  // as faces with boundaries
    if (!writer.AddShape(shape)) return false;
    writer.ComputeModel();
    IGESData_GlobalSection header = writer.Model()->GlobalSection();
    header.SetFileName(new TCollection_HAsciiString("regions"));
    header.SetDate(new TCollection_HAsciiString("19700101.000000"));
    header.SetLastChangeDate(new TCollection_HAsciiString("19700101.000000"));
    writer.Model()->SetGlobalSection(header);
    return writer.Write(out);
  }
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", unit.name);
  STEPControl_Writer writer;  // reads the unit
  Interface_Static::SetCVal("write.step.product.name", "regions");
  if (writer.Transfer(shape, STEPControl_AsIs) != IFSelect_RetDone) return false;
  APIHeaderSection_MakeHeader header(writer.Model());
  header.SetName(new TCollection_HAsciiString("regions"));
  header.SetTimeStamp(new TCollection_HAsciiString("1970-01-01T00:00:00"));
  StepData_StepWriter printer(writer.Model());
  printer.SendModel(Handle(StepData_Protocol)::DownCast(writer.Model()->Protocol()));
  return printer.Print(out);
}

// What cannot be written, for a disk is full, stops nothing.
template <class... Values>
void say(std::FILE* file, fmt::format_string<Values...> text, Values&&... values) {
  std::fputs(fmt::format(text, std::forward<Values>(values)...).c_str(), file);
}

void run(const Options& options) {
  const bool iges = is_iges(options.output);
  const step::Trims trims = step::read_trims(options.input);
  const step::Shell shell = step::build_shell(trims, options.tolerance);
  std::size_t sound = 0;
  for (std::size_t r = 0; r < shell.flaws.size(); ++r) {
    if (shell.flaws[r].empty()) ++sound;
    else
      say(stderr, "bisector-step: warning: the face of region {} ({}) {}\n", r,
          name_of(type_of(trims.regions[r].surface)), shell.flaws[r]);
  }
  std::ostringstream out;
  if (!print_shape(shell.shape, iges, unit_of(options.unit), out))
    throw Error(fmt::format("{}: OpenCASCADE cannot turn the faces into this format; try another", options.output));
  write_file(options.output, out.str());
  const char* kind = shell.shape.ShapeType() == TopAbs_SOLID   ? "a solid"
                     : shell.shape.ShapeType() == TopAbs_SHELL ? "a shell"
                                                               : "faces";
  say(stdout, "written    {}: {} of {} faces, {} sound\n", options.output, kind, shell.faces.size(), sound);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  const std::unique_ptr<CLI::App> app = make_command_line(options);
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app->exit(error) == 0 ? 0 : 2;
  }
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    say(stderr, "bisector-step: {}\n", error.what());
  } catch (const Standard_Failure& failure) {
    say(stderr, "bisector-step: OpenCASCADE failed: {}\n", failure.GetMessageString());
  }
  return 1;
}
