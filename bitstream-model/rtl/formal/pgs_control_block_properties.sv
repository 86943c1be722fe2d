// Properties of the registers: the rules of AXI4-Lite, one response for each request, a start with good arguments
// alone, the interrupt and its causes, and values that reads give back (specification, section 4).
`default_nettype none

module pgs_control_block_properties (
  input wire        clk,
  input wire        resetn,
  input wire [11:0] awaddr,
  input wire        awvalid,
  input wire        awready,
  input wire [31:0] wdata,
  input wire [3:0]  wstrb,
  input wire        wvalid,
  input wire        wready,
  input wire        bvalid,
  input wire        bready,
  input wire [11:0] araddr,
  input wire        arvalid,
  input wire        arready,
  input wire [31:0] rdata,
  input wire        rvalid,
  input wire        rready,
  input wire        interrupt,
  input wire        core_reset,
  input wire        core_clear,
  input wire        start,
  input wire [31:0] bodies,
  input wire [31:0] collisions,
  input wire [31:0] contact_iterations,
  input wire [31:0] friction_iterations,
  input wire        busy,
  input wire        done,
  input wire        error,
  input wire [7:0]  error_code,

  // Registers inside, for the properties of a start, an interrupt and a read.
  input wire        resets,              // a reset begins
  input wire        resetting,
  input wire        running,
  input wire        go,
  input wire        check,
  input wire        refused,
  input wire        sticky,
  input wire [7:0]  code,
  input wire        done_bit,
  input wire        gie,
  input wire [2:0]  ier,
  input wire [2:0]  isr,
  input wire [31:0] flags, time_step, drift, coefficient, friction, damping,
  input wire [31:0] gravity_x, gravity_y, gravity_z, spin_damping,

  // Registers inside, for the induction alone.
  input wire        has_address, has_data, whole,
  input wire [11:0] write_address,
  input wire [31:0] write_data,
  input wire        reading, read_s1, read_s2,
  input wire [11:0] read_address,
  input wire [31:0] argument_read, state_read, capability_read, result_read,
  input wire        asks_mass, asks_inertia,
  input wire        bodies_wrong, contacts_wrong, frictions_wrong, too_many
);
`include "pgs_interface.vh"
`include "pgs_schedule.vh"

  // ---- The master, and the core

  reg begun = 1'b0;
  reg [1:0] cycles = 2'd0;
  wire steady = &cycles;                 // the first reset has reached all registers
  reg quiet = 1'b0;                      // this cycle and the one before are without the reset of the pin
  reg        address_stays, word_stays, read_stays, was_reset;
  reg [11:0] address_before, read_before;
  reg [6:0]  word_before;               // of a word the bits that the properties need: the others go the same way
  always @(posedge clk) begin
    begun          <= 1'b1;
    cycles         <= cycles + {1'b0, ~steady};
    quiet          <= begun & resetn;
    was_reset      <= ~resetn;
    address_stays  <= resetn & awvalid & ~awready;
    word_stays     <= resetn & wvalid & ~wready;
    read_stays     <= resetn & arvalid & ~arready;
    address_before <= awaddr;
    word_before    <= {wstrb, wdata[2:0]};
    read_before    <= araddr;
  end
  always @* begin
    assume (begun | ~resetn);
    // AXI: no VALID in a reset and in the cycle behind it. One that is raised stays, with the same payload.
    if (~resetn | (begun & was_reset)) assume (~awvalid & ~wvalid & ~arvalid);
    if (begun & address_stays) assume (awvalid & (awaddr == address_before));
    if (begun & word_stays) assume (wvalid & ({wstrb, wdata[2:0]} == word_before));
    if (begun & read_stays) assume (arvalid & (araddr == read_before));
  end

  // A step runs from its start to its end, which comes at once behind an error; a reset ends it without a word.
  // An error comes in a step and stays until a reset.
  (* anyseq *) reg ends_now;
  reg              runs, ended, may_fail, failed;
  always @(posedge clk) begin
    runs     <= ~core_reset & (start | (busy & ~error & ~ends_now));
    ended    <= ~core_reset & busy & ~start & (error | ends_now);
    may_fail <= ~core_reset & busy;
    failed   <= ~core_reset & error;
  end
  always @* begin
    if (begun) assume ((busy == runs) & (done == ended) & (failed ? error : may_fail | ~error));
    assume (~error | (error_code != 0));
  end

  // ---- Open requests: their addresses and words

  reg        address_waits, word_waits;  // taken, without effect yet
  reg        answers, reads;             // a response is owed
  reg [11:0] address, asked;
  reg [2:0]  word;
  reg        all_strobes;
  // A write takes effect in the cycle in front of its response. One without all strobes has none.
  wire effect = address_waits & word_waits & ~bvalid;
  wire acts   = effect & all_strobes & ~resetting;
  always @(posedge clk) begin
    if (awvalid & awready) address <= awaddr;
    if (wvalid & wready) {all_strobes, word} <= {&wstrb, wdata[2:0]};
    if (arvalid & arready) asked <= araddr;
    address_waits <= resetn & (address_waits ? ~effect : awvalid & awready);
    word_waits    <= resetn & (word_waits ? ~effect : wvalid & wready);
    answers       <= resetn & (answers ? ~bready : effect);
    reads         <= resetn & (reads ? ~(rvalid & rready) : arvalid & arready);
  end

  always @* if (begun) begin
    // No request is taken while one of its kind waits.
    assert (~(awvalid & awready & address_waits));
    assert (~(wvalid & wready & word_waits));
    assert (~(arvalid & arready & reads));
    // Each write has one response, in the cycle behind its effect; no response comes without a request.
    assert (bvalid == answers);
    if (rvalid) assert (reads);
    // A read is answered in the third cycle behind its address.
    if (reads) assert ({1'b0, read_s1} + {1'b0, read_s2} + {1'b0, rvalid} == 2'd1);
    else assert (~read_s1 & ~read_s2 & ~rvalid);
    // The module keeps the address and the word of each request.
    assert ({has_address, has_data, reading} == {address_waits, word_waits, reads});
    if (has_address) assert (write_address == address);
    if (has_data) assert ({whole, write_data[2:0]} == {all_strobes, word});
    if (read_s1) assert (read_address == asked);
  end
  // A response stays, unchanged, until it is taken.
  always @(posedge clk) if (quiet) begin
    if ($past(bvalid & ~bready)) assert (bvalid);
    if ($past(rvalid & ~rready)) assert (rvalid & (rdata[1:0] == $past(rdata[1:0])));
  end

  // ---- Start

  wire asks = acts & (address == OFFSET_AP_CTRL) & word[0];
  wire ends = refused | (done & ~resetting);
  wire [2:0] causes = {refused | error, 2'b11} & {3{ends}};
  wire good = (bodies != 0) & (bodies <= CAPABILITY_BODY_CAPACITY) & (collisions <= CAPABILITY_COLLISION_CAPACITY)
            & (contact_iterations <= ITERATIONS_MAX) & (friction_iterations <= ITERATIONS_MAX);
  always @(posedge clk) if (quiet) begin
    assert (resets == $past(acts & (address == OFFSET_RESET) & word[0]));
    if ($past(resets)) assert (~go & ~check & ~start & ~refused & core_reset);
    else begin
      // A start is asked for by a write alone, while no step runs and no error stands, not even
      // one that comes with the end of a step in this cycle. It is checked, and either
      // begins or is refused, as its arguments are.
      assert (go == $past(asks & ~running & ~sticky & ~(ends & causes[2])));
      assert (check == $past(go));
      assert (start == $past(check & good));
      assert (refused == $past(check & ~good));
    end
  end
  always @* if (steady) begin
    if (start) assert (good & ~busy & ~core_reset & ~sticky);
    assert (core_clear == (core_reset | start));
    assert (running == (busy | go | check | start));
    assert (~(go & (check | start | busy)) & ~(check & (start | busy)) & ~(start & busy));
    if (check) assert (good == ~(bodies_wrong | contacts_wrong | frictions_wrong | too_many));
  end
  // The checks are a cycle behind the arguments, and settled before they are asked for.
  reg no_bodies, contacts_over, frictions_over, collisions_over;
  always @(posedge clk) begin
    no_bodies       <= (bodies == 0) | (bodies > CAPABILITY_BODY_CAPACITY);
    contacts_over   <= contact_iterations > ITERATIONS_MAX;
    frictions_over  <= friction_iterations > ITERATIONS_MAX;
    collisions_over <= collisions > CAPABILITY_COLLISION_CAPACITY;
  end
  always @* if (begun) assert ({bodies_wrong, contacts_wrong, frictions_wrong, too_many}
                               == {no_bodies, contacts_over, frictions_over, collisions_over});

  // ---- The interrupt, its causes, and the error

  always @(posedge clk) if (quiet) begin
    if ($past(resets)) assert ({gie, ier, isr, done_bit, sticky, code} == 0);
    else begin
      assert (gie == ($past(acts & (address == OFFSET_GIE)) ? $past(word[0]) : $past(gie)));
      assert (ier == ($past(acts & (address == OFFSET_IER)) ? $past(word) : $past(ier)));
      // A written 1 toggles a bit, enabled or not. A cause sets its bit while it is enabled, whatever is written.
      assert (isr == (($past(isr) ^ ({3{$past(acts & (address == OFFSET_ISR))}} & $past(word)))
                      | $past(causes & ier)));
      // The end of a step is told until AP_CTRL is read, and by this read, too.
      if ($past(ends)) assert (done_bit);
      else if ($past(~done_bit)) assert (~done_bit);
      else if ($past(done_bit) & ~done_bit) assert ($past(read_s1 & (asked == OFFSET_AP_CTRL)));
      // An error stays, with its code, until a reset.
      if (~check_failed) assert (sticky == $past(sticky | (done & ~resetting & error)));
      else assert (sticky);
      if ($past(sticky)) assert (code == $past(code));
    end
  end
  always @* assert (interrupt == (gie & |isr));
  reg check_failed;
  always @(posedge clk) check_failed <= check & ~good & ~resets;

  // ---- Reads

  // An argument keeps the last word that was written to it while no step ran. The solver picks the argument.
  (* anyseq *) reg [11:0] any_place;
  reg  [11:0] place;
  reg [1:0] kept, of_place;
  always @* case (place)
    OFFSET_BODIES:               of_place = bodies[1:0];
    OFFSET_COLLISIONS:           of_place = collisions[1:0];
    OFFSET_CONTACT_ITERATIONS:   of_place = contact_iterations[1:0];
    OFFSET_FRICTION_ITERATIONS:  of_place = friction_iterations[1:0];
    OFFSET_FLAGS:                of_place = flags[1:0];
    OFFSET_TIME_STEP:            of_place = time_step[1:0];
    OFFSET_POSITION_DRIFT:       of_place = drift[1:0];
    OFFSET_POSITION_COEFFICIENT: of_place = coefficient[1:0];
    OFFSET_FRICTION:             of_place = friction[1:0];
    OFFSET_ANGULAR_DAMPING:      of_place = damping[1:0];
    OFFSET_GRAVITY_X:            of_place = gravity_x[1:0];
    OFFSET_GRAVITY_Y:            of_place = gravity_y[1:0];
    OFFSET_GRAVITY_Z:            of_place = gravity_z[1:0];
    OFFSET_SPIN_DAMPING:         of_place = spin_damping[1:0];
    default:                     of_place = 2'd0;
  endcase
  wire is_argument = (place[11:2] >= 4) & (place[11:2] <= 30) & ~place[2] & (place[1:0] == 2'd0);
  reg reset_before = 1'b0;               // all arguments have their values of a reset, or are written
  always @(posedge clk) begin
    if (~begun) place <= any_place;
    if (begun & resets) begin
      reset_before <= 1'b1;
      kept         <= (place == OFFSET_SPIN_DAMPING) ? RESET_SPIN_DAMPING[1:0] : 2'd0;
    end else if (acts & is_argument & (address == place) & ~running) kept <= word[1:0];
  end
  always @* if (reset_before) assert (of_place == kept);

  // A read gives the value of two cycles earlier: the word of one register, selected a cycle earlier.
  wire [1:0]  selected = argument_read[1:0] | state_read[1:0] | capability_read[1:0] | result_read[1:0];
  wire        of_kept    = (asked == place) & is_argument;
  reg  [1:0]  kept_s1, kept_s2;
  reg         done_s1, done_s2;
  always @(posedge clk) {kept_s1, kept_s2, done_s1, done_s2} <= {kept, kept_s1, done_bit, done_s1};
  reg         answered;
  always @(posedge clk) answered <= read_s2;
  always @* begin
    if (steady & reset_before & read_s2) begin
      if (of_kept | (asked == OFFSET_AP_CTRL) | (asked[1:0] != 2'd0)) assert (~asks_mass & ~asks_inertia);
      if (of_kept) assert (selected == kept_s1);
      if (asked == OFFSET_AP_CTRL) assert (selected[1] == done_s1);
      if (asked[1:0] != 2'd0) assert (selected == 2'd0);
    end
    if (steady & reset_before & answered & rvalid) begin
      if (of_kept) assert (rdata[1:0] == kept_s2);
      if (asked == OFFSET_AP_CTRL) assert (rdata[1] == done_s2);
      // An address between words has no register.
      if (asked[1:0] != 2'd0) assert (rdata[1:0] == 2'd0);
    end
  end
endmodule

bind pgs_control_block pgs_control_block_properties properties (.*);

`default_nettype wire
