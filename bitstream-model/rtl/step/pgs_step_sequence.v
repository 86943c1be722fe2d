// The sequence of a step: load, setup, the passes with the drain of each, integration, end. It counts
// the cycles of work and the cycles of waiting.
//
//             cycles                         ends when
//   load      ceil(B / 2)                    all bodies are taken; with world inertia B cycles
//   setup     SETUP                          the finder has found the first collision
//   pass      slots x INTERVAL - (INTERVAL - 1)   the last issue; with the filling of a queue
//   drain     fill + INTERVAL - 1            its write-back can be read
//   enter     B                              all bodies are in the integration
//   leave     FINISH                         all results have left
//   settle    SETTLE                         the sums of the streams are complete
//
// Cycles beyond these are stalls of the interlock or waits for a stream.
`default_nettype none

module pgs_step_sequence #(
  parameter integer INTERVAL      = 2,  // cycles of a slot
  parameter integer SETUP         = 10, // whole slots
  parameter integer CONTACT_FILL  = 374,
  parameter integer FRICTION_FILL = 314,
  parameter integer FINISH        = 250
) (
  input  wire        clk,
  input  wire        reset,
  input  wire        start,
  input  wire        error,
  input  wire [19:0] collisions,        // or pairs of them, where two enter together
  input  wire [8:0]  contact_passes,    // with the warm one; 0 without collisions
  input  wire [8:0]  friction_passes,
  input  wire        warm_start,        // the first pass of each kind is a warm one
  input  wire        impulses_out,      // the last pass of each kind sends the impulses

  input  wire        loads,             // a body or a pair of them is taken
  input  wire        load_finished,
  input  wire        issues,
  input  wire        stalls,
  input  wire        waits,
  input  wire        enters,
  input  wire        enter_finished,
  input  wire        results_finished,

  output reg         busy,
  output reg         done,              // one cycle, at the end of a step or with its error
  output reg  [INTERVAL-1:0] phases,    // bit k: cycle k of a slot; cycle 0 is that of an issue
  output wire        loading,
  output reg         finding,
  output reg         passing,
  output reg         last_issue,        // the next issue is the last one of the pass
  output wire        draining,
  output wire        begin_pass,        // in the cycle before a pass or the integration
  output wire        integrating,
  output reg         friction,          // the kind of the pass
  output reg         first_of_kind,
  output reg         last_contact,
  output reg         warm,              // the pass takes the given impulses
  output reg         next_warm,         // the same; of the next pass while one drains
  output reg         sends,             // the pass sends its impulses
  output reg         next_sends,        // the same; of the next pass while one drains
  output reg         parity,            // of the pass; of the next one while it drains

  output reg  [63:0] cycles,
  output wire [31:0] work_cycles,       // saturates; counted a cycle later
  output wire [31:0] wait_cycles        // saturates; counted a cycle later
);
  localparam [3:0] FIND  = 4'd4;        // cycle of the setup from which on the finder runs

  localparam [2:0] SETTLE = 3'd3;

  localparam integer CONTACT_DRAIN  = CONTACT_FILL + INTERVAL - 2;
  localparam integer FRICTION_DRAIN = FRICTION_FILL + INTERVAL - 2;

  localparam IDLE    = 3'd0;
  localparam LOAD    = 3'd1;
  localparam PREPARE = 3'd2;
  localparam PASS    = 3'd3;
  localparam DRAIN   = 3'd4;
  localparam ENTER   = 3'd5;
  localparam LEAVE   = 3'd6;
  localparam SETTLED = 3'd7;

  reg [2:0]  state;
  reg [3:0]  setup;
  reg [19:0] left;                      // collisions of the pass that are not issued
  reg [9:0]  drain;
  reg        drain_one;
  reg [8:0]  contacts_left, frictions_left;
  reg        pass_is_last;              // no pass follows this one
  reg        no_passes;
  reg        no_contacts, one_contact, no_frictions, one_friction, one_collision;   // settled before a start
  reg [9:0]  leave;
  reg        leave_over;
  reg [2:0]  settle;
  reg [1:0]  lost_left;                 // further cycles of a slot that was lost
  reg        lost_to_stream;

  assign loading     = state == LOAD;
  assign draining    = state == DRAIN;
  assign integrating = state == ENTER | state == LEAVE;

  wire setup_ends = state == PREPARE & (setup == SETUP[3:0] - 4'd1);
  wire drain_ends = state == DRAIN & drain_one;
  assign begin_pass = setup_ends | drain_ends;

  // Counts of the passes, as they are when the next one begins.
  wire last_of_kind = friction ? frictions_left == 9'd1 : contacts_left == 9'd1;
  wire kind_changes = ~friction & last_of_kind;
  wire next_is_last = kind_changes ? frictions_left == 9'd1
                    : friction ? frictions_left == 9'd2 : contacts_left == 9'd2;

  always @(posedge clk) begin
    done <= 1'b0;
    no_contacts   <= contact_passes == 9'd0;
    one_contact   <= contact_passes == 9'd1;
    no_frictions  <= friction_passes == 9'd0;
    one_friction  <= friction_passes == 9'd1;
    one_collision <= collisions == 20'd1;
    // The slots run from the setup on, so that every step has the same.
    phases <= (state == IDLE | state == LOAD) ? {{(INTERVAL-1){1'b0}}, 1'b1} : {phases[INTERVAL-2:0], phases[INTERVAL-1]};
    if (reset) begin
      state   <= IDLE;
      busy    <= 1'b0;
      passing <= 1'b0;
      finding <= 1'b0;
    end else if (start) begin
      state          <= LOAD;
      busy           <= 1'b1;
      passing        <= 1'b0;
      finding        <= 1'b0;
      setup          <= 4'd0;
      contacts_left  <= contact_passes;
      frictions_left <= friction_passes;
      no_passes      <= no_contacts & no_frictions;
      friction       <= no_contacts;
      last_contact   <= one_contact;
      first_of_kind  <= 1'b1;
      {warm, next_warm}   <= {2{warm_start}};
      {sends, next_sends} <= {2{impulses_out & (no_contacts ? one_friction : one_contact)}};
      parity         <= 1'b0;
      leave          <= FINISH[9:0];
      leave_over     <= 1'b0;
    end else if (busy & error) begin
      state   <= IDLE;
      busy    <= 1'b0;
      passing <= 1'b0;
      finding <= 1'b0;
      done    <= 1'b1;
    end else begin
      case (state)
        LOAD: if (load_finished) state <= PREPARE;
        PREPARE: begin
          setup    <= setup + 4'd1;
          left     <= collisions;
          last_issue <= one_collision;
          if (setup == FIND - 4'd1) finding <= 1'b1;
          if (setup_ends) begin
            state   <= no_passes ? ENTER : PASS;
            finding <= ~no_passes;
            passing <= ~no_passes;
          end
        end
        PASS: if (issues) begin
          left         <= left - 20'd1;
          last_issue     <= left == 20'd2;
          pass_is_last <= friction ? frictions_left == 9'd1
                        : (contacts_left == 9'd1) & (frictions_left == 9'd0);
          drain        <= friction ? FRICTION_DRAIN[9:0] : CONTACT_DRAIN[9:0];
          drain_one    <= 1'b0;
          if (last_issue) begin
            state   <= DRAIN;
            passing <= 1'b0;
            parity  <= ~parity;
          end
        end
        DRAIN: begin
          drain     <= drain - 10'd1;
          drain_one <= drain == 10'd1;
          left      <= collisions;
          last_issue  <= one_collision;
          next_warm  <= warm_start & kind_changes;
          next_sends <= impulses_out & next_is_last;
          if (drain_one) begin
            finding       <= ~pass_is_last;
            state         <= pass_is_last ? ENTER : PASS;
            passing       <= ~pass_is_last;
            first_of_kind <= kind_changes;
            warm          <= next_warm;
            sends         <= next_sends;
            if (friction) frictions_left <= frictions_left - 9'd1;
            else contacts_left <= contacts_left - 9'd1;
            friction      <= friction | last_of_kind;
            last_contact  <= ~friction & (contacts_left == 9'd2);
          end
        end
        ENTER: if (enter_finished) state <= LEAVE;
        LEAVE: begin
          if (~leave_over) leave <= leave - 10'd1;
          leave_over <= leave_over | (leave == 10'd1);
          settle <= SETTLE;
          if (leave_over & results_finished) state <= SETTLED;
        end
        SETTLED: begin
          settle <= settle - 3'd1;
          if (settle == 3'd1) begin
            state <= IDLE;
            busy  <= 1'b0;
            done  <= 1'b1;
          end
        end
        default: ;
      endcase
    end
  end

  // Where the cycle went. The counts follow a cycle behind, so that their adders begin at registers, and
  // a 33rd bit tells that one has run over.
  wire lost_here = (loading & ~loads & ~load_finished) | stalls | waits
                 | (state == ENTER & ~enters & ~enter_finished)
                 | (state == LEAVE & leave_over & ~results_finished);
  wire waiting   = lost_here & ~stalls;
  localparam integer FURTHER = INTERVAL - 1;
  reg        works, loses;
  reg [31:0] worked, waited;
  reg        worked_full, waited_full;
  assign work_cycles = worked | {32{worked_full}};
  assign wait_cycles = waited | {32{waited_full}};
  always @(posedge clk) begin
    if (stalls | waits) begin
      lost_left      <= FURTHER[1:0];
      lost_to_stream <= waits;
    end else if (lost_left != 2'd0) begin
      lost_left <= lost_left - 2'd1;
    end
    works <= busy & ~lost_here & (lost_left == 2'd0);
    loses <= busy & (waiting | (lost_to_stream & (lost_left != 2'd0)));
    {worked_full, worked} <= {worked_full, 32'd0} | ({1'b0, worked} + {32'd0, works});
    {waited_full, waited} <= {waited_full, 32'd0} | ({1'b0, waited} + {32'd0, loses});
    if (busy) cycles <= cycles + 64'd1;
    if (start) begin
      cycles                <= 64'd0;
      {worked_full, worked} <= 33'd0;
      {waited_full, waited} <= 33'd0;
      {works, loses}        <= 2'b00;
      lost_left             <= 2'd0;
    end
  end
endmodule

`default_nettype wire
