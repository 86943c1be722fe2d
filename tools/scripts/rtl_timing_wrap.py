#!/usr/bin/env python3
"""Makes a module of generated Verilog ready for place and route on its own.

usage: rtl_timing_wrap.py wrap PORTS MODULE [PARAMETER=VALUE...]     a module `wrap` around it, with three pins
       rtl_timing_wrap.py stub PORTS MODULE     a module of its name, parameters and ports with next to no logic

PORTS is a file that Yosys' write_json wrote of the module, with these parameters.

`wrap` feeds the inputs from a shift register and folds the outputs, four bits a cycle, into one: all paths
of the module begin and end at registers, and none of the wrapper's is long. `stub` folds the inputs into the
outputs in the same way, so that no logic around the module vanishes.
"""
import json
import sys

CLOCKS = {"clk", "aclk"}


def read(path, module):
    """Names of the parameters; direction, width and name of each port."""
    with open(path, encoding="utf-8") as file:
        found = json.load(file)["modules"][module]
    ports = [(port["direction"], len(port["bits"]), name) for name, port in found["ports"].items()]
    return list(found.get("parameter_default_values", {})), ports


def wrap(module, parameters, found):
    """The wrapper."""
    inputs = [(width, name) for way, width, name in found if way == "input" and name not in CLOCKS]
    outputs = [(width, name) for way, width, name in found if way == "output"]
    clock = next(name for _, _, name in found if name in CLOCKS)
    bits_in, bits_out = sum(width for width, _ in inputs), sum(width for width, _ in outputs)
    print("module wrap (input wire clk, input wire in, output wire out);")
    print(f"  reg [{bits_in - 1}:0] inputs;")
    print(f"  always @(posedge clk) inputs <= {{inputs[{bits_in - 2}:0], in}};")
    print(f"  wire [{bits_out - 1}:0] outputs;")
    connections, at = [f".{clock}(clk)"], 0
    for width, name in inputs:
        connections.append(f".{name}(inputs[{at} +: {width}])")
        at += width
    at = 0
    for width, name in outputs:
        connections.append(f".{name}(outputs[{at} +: {width}])")
        at += width
    values = ", ".join(".{}({})".format(*parameter.split("=")) for parameter in parameters)
    print(f"  {module} {f'#({values}) ' if values else ''}wrapped ({', '.join(connections)});")
    print(f"  reg [{bits_out - 1}:0] fold0;")
    print("  always @(posedge clk) fold0 <= outputs;")
    level, width = 0, bits_out
    while width > 1:
        folded = (width + 3) // 4
        print(f"  reg [{folded - 1}:0] fold{level + 1};")
        print("  always @(posedge clk) begin")
        for i in range(folded):
            last = min(4 * i + 3, width - 1)
            print(f"    fold{level + 1}[{i}] <= ^fold{level}[{last}:{4 * i}];")
        print("  end")
        level, width = level + 1, folded
    print(f"  assign out = fold{level}[0];")
    print("endmodule")


def stub(module, parameters, found):
    """The stub: two registers deep, an exclusive or of a few inputs at every output."""
    inputs = [(width, name) for way, width, name in found if way == "input" and name not in CLOCKS]
    outputs = [(width, name) for way, width, name in found if way == "output"]
    bits_in, bits_out = sum(width for width, _ in inputs), sum(width for width, _ in outputs)
    # Instances may give them.
    values = ", ".join(f"parameter {name} = 0" for name in parameters)
    print(f"module {module} {f'#({values}) ' if values else ''}(")
    print(",\n".join(f"  {way} wire [{width - 1}:0] {name}" for way, width, name in found))
    print(");")
    rows = -(-bits_in // bits_out)
    print(f"  reg [{rows * bits_out - 1}:0] inputs;")
    print(f"  reg [{bits_out - 1}:0] outputs;")
    print("  always @(posedge clk) begin")
    print(f"    inputs <= {{{', '.join(name for _, name in inputs)}}};")
    print("    outputs <= " + " ^ ".join(f"inputs[{i * bits_out} +: {bits_out}]" for i in range(rows)) + ";")
    print("  end")
    print(f"  assign {{{', '.join(name for _, name in outputs)}}} = outputs;")
    print("endmodule")


def main():
    """Writes the module to standard output."""
    if len(sys.argv) < 4 or sys.argv[1] not in ("wrap", "stub"):
        sys.exit(__doc__)
    what, path, module, *given = sys.argv[1:]
    parameters, found = read(path, module)
    if what == "wrap":
        wrap(module, given, found)
    else:
        stub(module, parameters, found)


if __name__ == "__main__":
    main()
