BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('v3');
CREATE TABLE audit (
	id INTEGER NOT NULL, 
	at TEXT NOT NULL, 
	person TEXT NOT NULL, 
	login TEXT NOT NULL, 
	action TEXT NOT NULL, 
	subject TEXT NOT NULL, 
	content TEXT NOT NULL, 
	previous TEXT NOT NULL, 
	sha256 TEXT NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT audit_previous UNIQUE (previous)
);
INSERT INTO "audit" VALUES(1,'2026-11-23T20:12:19.379805Z','operator','','enter','campaign c6c569c69dc71848b9650dbc51ce619583806c2902a14e744c49c53a729cd9df','{"cell": "plant/cell-1", "facts": ["robot: UR10e, R-cell-1", "controller: CB5, C-cell-1", "firmware: 5.11", "safety_checksum: A1B2", "tool: gripper", "program: pick 3", "covers: none", "device: PFMD, D1"], "folder": "/plant/cell-1", "rows": {"campaigns": [1, "9a070f5fb59f386bb6a3760cc70ed934f26ddb08a730851566f09ec77d739c04"], "cells": [1, "74a7d66d397fa623b7393cc4859e4c8cb32311182ae0a88a83d9d9a3e90e6fb1"], "facts": [8, "759ea745e4adda710938940d3afbe331594e724c63a25341f28888bd35a1c54d"], "impacts": [30, "5797a5a5d460563d0e7653efda1a4d6bde2abc08778b5a6776de1e16294fe01c"], "recordings": [30, "e1ffedb2387ec5d1fbf087c0c4acbacc8426d3f5a2548bda76867e41bab1a203"], "uses": [30, "cd7864bedd9b99382f682db6b20d2ad8f0114496945e985b2bb572c16b3410e2"]}}','0000000000000000000000000000000000000000000000000000000000000000','7e0d6d7de178230876dd1ae9e57dd4b639e9811e1235039e3a25b5a83740471b');
INSERT INTO "audit" VALUES(2,'2026-11-23T20:12:19.433295Z','operator','','enter','more','{"rows": {"contact_points": [1, "64c03d319f43873f9ec0155f827f467895f299d27b625192470a6de302b6e58f"], "maps": [1, "5060aa49d9996ee52e8dd5fba0278e0c9e44d56986bfdf26c419143502ce9c71"]}}','7e0d6d7de178230876dd1ae9e57dd4b639e9811e1235039e3a25b5a83740471b','50063a48ce7035a494281067fd669633c466440cbc9971f014cfcd79809e2fde');
INSERT INTO "audit" VALUES(3,'2026-11-23T20:12:19.457616Z','operator','','release','release 1','{"rows": {"releases": [1, "ae66739ec0c2190860ea14f76abe9d9156bfe28b4220bb4ef4839168cbd4f560"]}}','50063a48ce7035a494281067fd669633c466440cbc9971f014cfcd79809e2fde','56988d6e53fcbd1ba3a3b69f2db3da38e649a164879a06e59ea1bd057aa55ba3');
INSERT INTO "audit" VALUES(4,'2026-11-23T20:12:19.466555Z','operator','','withdraw','release 1','{"reason": "x", "rows": {"withdrawals": [1, "3b7bd5429f27ce7393b57a35c7b67772a48076eac67dc05ae8314d52c24820a9"]}}','56988d6e53fcbd1ba3a3b69f2db3da38e649a164879a06e59ea1bd057aa55ba3','4641a7c1e03054119ad271d2ab7af6e0c383644512da8e12ef4943de2fb563ee');
CREATE TABLE campaigns (
	id INTEGER NOT NULL, 
	cell_id INTEGER, 
	sha256 TEXT NOT NULL, 
	name TEXT NOT NULL, 
	folder TEXT NOT NULL, 
	binding TEXT NOT NULL, 
	conditions TEXT NOT NULL, 
	device TEXT NOT NULL, 
	measured_on TEXT, 
	calibrated TEXT, 
	calibrated_until TEXT, 
	"device_error_N" FLOAT, 
	simulated INTEGER NOT NULL, 
	recordings INTEGER NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT campaigns_content UNIQUE (sha256, cell_id), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "campaigns" VALUES(1,1,'c6c569c69dc71848b9650dbc51ce619583806c2902a14e744c49c53a729cd9df','cell-1','/plant/cell-1','bound','{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}','PFMD, D1','2026-02-01','2025-07-01','2026-07-01',3.0,0,30,1);
CREATE TABLE cells (
	id INTEGER NOT NULL, 
	site TEXT NOT NULL, 
	name TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT cells_name UNIQUE (site, name), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "cells" VALUES(1,'plant','cell-1',1);
CREATE TABLE contact_points (
	id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	area TEXT NOT NULL, 
	contact TEXT NOT NULL, 
	rests_on TEXT NOT NULL, 
	programmed_mps FLOAT, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "contact_points" VALUES(1,1,'P1','chest','transient','map',0.25,2);
CREATE TABLE facts (
	id INTEGER NOT NULL, 
	cell_id INTEGER NOT NULL, 
	campaign_id INTEGER, 
	kind TEXT NOT NULL, 
	since TEXT NOT NULL, 
	value TEXT, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "facts" VALUES(1,1,1,'robot','2026-02-01T23:59:59.999999Z','UR10e, R-cell-1',1);
INSERT INTO "facts" VALUES(2,1,1,'controller','2026-02-01T23:59:59.999999Z','CB5, C-cell-1',1);
INSERT INTO "facts" VALUES(3,1,1,'firmware','2026-02-01T23:59:59.999999Z','5.11',1);
INSERT INTO "facts" VALUES(4,1,1,'safety_checksum','2026-02-01T23:59:59.999999Z','A1B2',1);
INSERT INTO "facts" VALUES(5,1,1,'tool','2026-02-01T23:59:59.999999Z','gripper',1);
INSERT INTO "facts" VALUES(6,1,1,'program','2026-02-01T23:59:59.999999Z','pick 3',1);
INSERT INTO "facts" VALUES(7,1,1,'covers','2026-02-01T23:59:59.999999Z','none',1);
INSERT INTO "facts" VALUES(8,1,1,'device','2026-02-01T23:59:59.999999Z','PFMD, D1',1);
CREATE TABLE impacts (
	id INTEGER NOT NULL, 
	recording_id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	curve TEXT NOT NULL, 
	state_id TEXT NOT NULL, 
	use TEXT NOT NULL, 
	flags TEXT NOT NULL, 
	distance_m FLOAT, 
	height_m FLOAT, 
	speed_mps FLOAT, 
	"peak_force_N" FLOAT, 
	"phase2_force_N" FLOAT, 
	"largest_N" FLOAT, 
	repeat INTEGER NOT NULL, 
	whole INTEGER NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(recording_id) REFERENCES recordings (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "impacts" VALUES(1,1,1,'','s00','used','',0.52,0.14,0.15,205.28,1.6,205.28,1,1,1);
INSERT INTO "impacts" VALUES(2,2,1,'','s01','used','',0.52,0.14,0.25,281.75,1.6,281.75,1,1,1);
INSERT INTO "impacts" VALUES(3,3,1,'','s02','used','',0.52,0.14,0.35,363.45,1.6,363.45,1,1,1);
INSERT INTO "impacts" VALUES(4,4,1,'','s03','used','',0.56,0.29,0.15,142.22,1.6,142.22,1,1,1);
INSERT INTO "impacts" VALUES(5,5,1,'','s04','used','',0.56,0.29,0.25,205.59,1.6,205.59,1,1,1);
INSERT INTO "impacts" VALUES(6,6,1,'','s05','used','',0.56,0.29,0.35,265.29,1.6,265.29,1,1,1);
INSERT INTO "impacts" VALUES(7,7,1,'','s06','used','',0.6,0.44,0.15,97.37,1.6,97.37,1,1,1);
INSERT INTO "impacts" VALUES(8,8,1,'','s07','used','',0.6,0.44,0.25,139.19,1.6,139.19,1,1,1);
INSERT INTO "impacts" VALUES(9,9,1,'','s08','used','',0.6,0.44,0.35,182.95,1.6,182.95,1,1,1);
INSERT INTO "impacts" VALUES(10,10,1,'','s09','used','',0.64,0.24,0.15,136.67,1.6,136.67,1,1,1);
INSERT INTO "impacts" VALUES(11,11,1,'','s10','used','',0.64,0.24,0.25,191.9,1.6,191.9,1,1,1);
INSERT INTO "impacts" VALUES(12,12,1,'','s11','used','',0.64,0.24,0.35,255.84,1.6,255.84,1,1,1);
INSERT INTO "impacts" VALUES(13,13,1,'','s12','used','',0.68,0.39,0.15,96.94,1.6,96.94,1,1,1);
INSERT INTO "impacts" VALUES(14,14,1,'','s13','used','',0.68,0.39,0.25,140.41,1.6,140.41,1,1,1);
INSERT INTO "impacts" VALUES(15,15,1,'','s14','used','',0.68,0.39,0.35,185.69,1.6,185.69,1,1,1);
INSERT INTO "impacts" VALUES(16,16,1,'','s15','used','',0.72,0.19,0.15,124.71,1.6,124.71,1,1,1);
INSERT INTO "impacts" VALUES(17,17,1,'','s16','used','',0.72,0.19,0.25,179.68,1.6,179.68,1,1,1);
INSERT INTO "impacts" VALUES(18,18,1,'','s17','used','',0.72,0.19,0.35,237.93,1.6,237.93,1,1,1);
INSERT INTO "impacts" VALUES(19,19,1,'','s18','used','',0.76,0.34,0.15,91.79,1.6,91.79,1,1,1);
INSERT INTO "impacts" VALUES(20,20,1,'','s19','used','',0.76,0.34,0.25,137.39,1.6,137.39,1,1,1);
INSERT INTO "impacts" VALUES(21,21,1,'','s20','used','',0.76,0.34,0.35,185.9,1.6,185.9,1,1,1);
INSERT INTO "impacts" VALUES(22,22,1,'','s21','used','',0.8,0.14,0.15,107.87,1.6,107.87,1,1,1);
INSERT INTO "impacts" VALUES(23,23,1,'','s22','used','',0.8,0.14,0.25,168.55,1.6,168.55,1,1,1);
INSERT INTO "impacts" VALUES(24,24,1,'','s23','used','',0.8,0.14,0.35,227.33,1.6,227.33,1,1,1);
INSERT INTO "impacts" VALUES(25,25,1,'','s24','used','',0.84,0.29,0.15,79.94,1.6,79.94,1,1,1);
INSERT INTO "impacts" VALUES(26,26,1,'','s25','used','',0.84,0.29,0.25,123.03,1.6,123.03,1,1,1);
INSERT INTO "impacts" VALUES(27,27,1,'','s26','used','',0.84,0.29,0.35,177.71,1.6,177.71,1,1,1);
INSERT INTO "impacts" VALUES(28,28,1,'','s27','used','',0.88,0.44,0.15,68.22,1.6,68.22,1,1,1);
INSERT INTO "impacts" VALUES(29,29,1,'','s28','used','',0.88,0.44,0.25,106.95,1.6,106.95,1,1,1);
INSERT INTO "impacts" VALUES(30,30,1,'','s29','used','',0.88,0.44,0.35,150.55,1.6,150.55,1,1,1);
CREATE TABLE maps (
	id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	sha256 TEXT NOT NULL, 
	file TEXT NOT NULL, 
	form TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "maps" VALUES(1,1,'abababababababababababababababababababababababababababababababab','maps/a.json','CFM_3D',2);
CREATE TABLE recordings (
	id INTEGER NOT NULL, 
	sha256 TEXT NOT NULL, 
	size_bytes BIGINT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT recordings_content UNIQUE (sha256), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "recordings" VALUES(1,'1c9e43e44d366ec7e0a9256cc151e60dd0e8abf6e8f7df4fdcd86fb02ab73bf2',9,1);
INSERT INTO "recordings" VALUES(2,'a66a7362d701640e8f484f39f5127aad501589073dae680ffdac5e23af0c6687',9,1);
INSERT INTO "recordings" VALUES(3,'cc2500748302269960941ff14d0e628c558092cc7c082c73a1a6240fa2d29c9c',9,1);
INSERT INTO "recordings" VALUES(4,'ffc606c258f29140605485c83726bacfe7c3dd1e1b129d9b5ec5daef757029d6',9,1);
INSERT INTO "recordings" VALUES(5,'6943baebddb7d430a675777acd7b81e6335cf0e814ca0743fccb5fe9eb9849fe',9,1);
INSERT INTO "recordings" VALUES(6,'8310c02e3434436985ce11a9f3f4c74704a63efcdb99978f76a7660c5cfa6902',9,1);
INSERT INTO "recordings" VALUES(7,'7c31c95098e698b6a029f1afa9ed61a8ab11fd279e44c215cc399a4d695eeb72',9,1);
INSERT INTO "recordings" VALUES(8,'e4e212595c64307a366c69d768ed57142ccc5b6365079c60fb9e85fdb87888ec',9,1);
INSERT INTO "recordings" VALUES(9,'84c5e3a9caf7911fb9e24013e20a0c50baaf485baf223ff330e703c6d4c49ab8',9,1);
INSERT INTO "recordings" VALUES(10,'413b170a5ae4616d7d9edefc5e364a58f1ec16271aaeca4e9ba9143a03bed1d6',9,1);
INSERT INTO "recordings" VALUES(11,'158268579e4b88f710c4a706b21e1e215024a6535685abad5236ccec90bbf9dd',9,1);
INSERT INTO "recordings" VALUES(12,'580cdb67aaf2c83a1549493892d3ccb5418257a8129b488d41d99adc108612f9',9,1);
INSERT INTO "recordings" VALUES(13,'385412b1d99273e3b41338324bcc4c3cab84acfdc8c4a0bc4f9d73538cb1b051',9,1);
INSERT INTO "recordings" VALUES(14,'10336d9596c95b5485945b0c3d841a94cb34f881007962bdb723db5e2b237ff1',9,1);
INSERT INTO "recordings" VALUES(15,'c0ba6bae86f550192aba1f837e33eabd2d6a95e2d8fcd4c586f138e1b977d632',9,1);
INSERT INTO "recordings" VALUES(16,'b8147e17c543464beb9228d9c05da365a1b4d89abfb82ebcfa507f1296ae62f3',9,1);
INSERT INTO "recordings" VALUES(17,'1a1fba22883982518ac8aa78b1ab03e0f3fd2650ad6e87e50d27eb20093e45e0',9,1);
INSERT INTO "recordings" VALUES(18,'33f817295a7095bf481be879559b782ec68f1a19321685864d00ef96214d6533',9,1);
INSERT INTO "recordings" VALUES(19,'cb2f84ebf5b3cb10b874e07dd0ade7ddd4b45fdabe3d37957e06505f4dd87541',9,1);
INSERT INTO "recordings" VALUES(20,'8821ee7897a5b9914e340cf35d59b0822d2d8d1925e21e3a44962115f85f758f',9,1);
INSERT INTO "recordings" VALUES(21,'80eaf86b061c18a5c0ff59f6569f4b51941ff93693079ec06f8c91eb9c941d40',9,1);
INSERT INTO "recordings" VALUES(22,'ec79c842242858409ebecba9197879846c7761a0aeecd3a5bc3c8852ebe00e30',9,1);
INSERT INTO "recordings" VALUES(23,'a6e938636ffedbd06d38c704032779a994b5defa285358e1e78d069b344b5cf3',9,1);
INSERT INTO "recordings" VALUES(24,'7269bc528186796c777c5c557ae095bcb85084217eb27a7f4be74121466af186',9,1);
INSERT INTO "recordings" VALUES(25,'5c677cfec6986e2e9aa78286f18b3c6857759d2668f0a792e0a4f729f2be255d',9,1);
INSERT INTO "recordings" VALUES(26,'41cdc4a5c98eca0958857524b83c70d0f4d41a27e47fd52c3957f2388e835589',9,1);
INSERT INTO "recordings" VALUES(27,'2b292db3e2f4deda2914fa964153aaa1e1fa4f36826b2b1f40cb4d37e2fb0edf',9,1);
INSERT INTO "recordings" VALUES(28,'9c85cccea81f6312d966368159b9701e1c6f513cdce29f2e3cb2fed81b98db21',9,1);
INSERT INTO "recordings" VALUES(29,'52b2f7218f73d52edce3844c1a4cbeeaccd65eca22609f1a39fbc852950116ff',9,1);
INSERT INTO "recordings" VALUES(30,'9425a907c657a084ee4c386408102985cf875a6d4056825c13a98144af310545',9,1);
CREATE TABLE releases (
	id INTEGER NOT NULL, 
	cell_id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	subject TEXT NOT NULL, 
	areas TEXT NOT NULL, 
	contact TEXT NOT NULL, 
	bound TEXT NOT NULL, 
	speeds TEXT NOT NULL, 
	report_sha256 TEXT NOT NULL, 
	conditions TEXT NOT NULL, 
	person TEXT NOT NULL, 
	at TEXT NOT NULL, 
	map_sha256 TEXT, 
	valid_until TEXT, 
	measured_on TEXT, 
	calibrated TEXT, 
	calibrated_until TEXT, 
	"limit_N" FLOAT, 
	"device_spring_N_per_m" FLOAT, 
	"area_spring_N_per_m" FLOAT, 
	simulated INTEGER NOT NULL, 
	replaces INTEGER, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT releases_replaces UNIQUE (replaces), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(replaces) REFERENCES releases (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "releases" VALUES(1,1,1,'workspace','chest','transient','b','{"lowest_to_program_mps": 0.1, "highest_to_program_mps": 0.2}','0000000000000000000000000000000000000000000000000000000000000000','{"controller": "CB5, C-cell-1", "covers": "none", "device": "PFMD, D1", "firmware": "5.11", "program": "pick 3", "robot": "UR10e, R-cell-1", "safety_checksum": "A1B2", "tool": "gripper"}','operator','2026-11-23T20:12:19.457616Z','abababababababababababababababababababababababababababababababab','2027-09-19','2026-02-01',NULL,'2026-12-31',280.0,75000.0,25000.0,0,NULL,3);
CREATE TABLE uses (
	id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	impact_id INTEGER NOT NULL, 
	file TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(impact_id) REFERENCES impacts (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "uses" VALUES(1,1,1,'s00-r1.csv',1);
INSERT INTO "uses" VALUES(2,1,2,'s01-r1.csv',1);
INSERT INTO "uses" VALUES(3,1,3,'s02-r1.csv',1);
INSERT INTO "uses" VALUES(4,1,4,'s03-r1.csv',1);
INSERT INTO "uses" VALUES(5,1,5,'s04-r1.csv',1);
INSERT INTO "uses" VALUES(6,1,6,'s05-r1.csv',1);
INSERT INTO "uses" VALUES(7,1,7,'s06-r1.csv',1);
INSERT INTO "uses" VALUES(8,1,8,'s07-r1.csv',1);
INSERT INTO "uses" VALUES(9,1,9,'s08-r1.csv',1);
INSERT INTO "uses" VALUES(10,1,10,'s09-r1.csv',1);
INSERT INTO "uses" VALUES(11,1,11,'s10-r1.csv',1);
INSERT INTO "uses" VALUES(12,1,12,'s11-r1.csv',1);
INSERT INTO "uses" VALUES(13,1,13,'s12-r1.csv',1);
INSERT INTO "uses" VALUES(14,1,14,'s13-r1.csv',1);
INSERT INTO "uses" VALUES(15,1,15,'s14-r1.csv',1);
INSERT INTO "uses" VALUES(16,1,16,'s15-r1.csv',1);
INSERT INTO "uses" VALUES(17,1,17,'s16-r1.csv',1);
INSERT INTO "uses" VALUES(18,1,18,'s17-r1.csv',1);
INSERT INTO "uses" VALUES(19,1,19,'s18-r1.csv',1);
INSERT INTO "uses" VALUES(20,1,20,'s19-r1.csv',1);
INSERT INTO "uses" VALUES(21,1,21,'s20-r1.csv',1);
INSERT INTO "uses" VALUES(22,1,22,'s21-r1.csv',1);
INSERT INTO "uses" VALUES(23,1,23,'s22-r1.csv',1);
INSERT INTO "uses" VALUES(24,1,24,'s23-r1.csv',1);
INSERT INTO "uses" VALUES(25,1,25,'s24-r1.csv',1);
INSERT INTO "uses" VALUES(26,1,26,'s25-r1.csv',1);
INSERT INTO "uses" VALUES(27,1,27,'s26-r1.csv',1);
INSERT INTO "uses" VALUES(28,1,28,'s27-r1.csv',1);
INSERT INTO "uses" VALUES(29,1,29,'s28-r1.csv',1);
INSERT INTO "uses" VALUES(30,1,30,'s29-r1.csv',1);
CREATE TABLE withdrawals (
	id INTEGER NOT NULL, 
	release_id INTEGER NOT NULL, 
	reason TEXT NOT NULL, 
	person TEXT NOT NULL, 
	at TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(release_id) REFERENCES releases (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "withdrawals" VALUES(1,1,'x','operator','2026-11-23T20:12:19.466555Z',4);
CREATE INDEX campaigns_cell ON campaigns (cell_id);
CREATE INDEX facts_cell ON facts (cell_id, kind);
CREATE INDEX facts_value ON facts (kind, value);
CREATE INDEX impacts_recording ON impacts (recording_id);
CREATE INDEX uses_campaign ON uses (campaign_id);
CREATE INDEX uses_impact ON uses (impact_id);
CREATE INDEX maps_sha256 ON maps (sha256);
CREATE INDEX releases_cell ON releases (cell_id);
CREATE INDEX releases_map ON releases (map_sha256);
CREATE INDEX withdrawals_release ON withdrawals (release_id);
CREATE TRIGGER audit_kept_update before update on audit begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER audit_kept_delete before delete on audit begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER audit_kept_insert before insert on audit when exists (select 1 from audit where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER cells_kept_update before update on cells begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER cells_kept_delete before delete on cells begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER campaigns_kept_update before update on campaigns begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER campaigns_kept_delete before delete on campaigns begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER facts_kept_update before update on facts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER facts_kept_delete before delete on facts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_update before update on recordings begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_delete before delete on recordings begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_insert before insert on recordings when exists (select 1 from recordings where sha256 = new.sha256) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_update before update on impacts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_delete before delete on impacts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_insert before insert on impacts when exists (select 1 from impacts where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER uses_kept_update before update on uses begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER uses_kept_delete before delete on uses begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER maps_kept_update before update on maps begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER maps_kept_delete before delete on maps begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_update before update on releases begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_delete before delete on releases begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_insert before insert on releases when exists (select 1 from releases where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_update before update on withdrawals begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_delete before delete on withdrawals begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_insert before insert on withdrawals when exists (select 1 from withdrawals where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE INDEX contact_points_campaign ON contact_points (campaign_id);
CREATE INDEX impacts_largest ON impacts ("largest_N", campaign_id, whole);
CREATE INDEX impacts_whole ON impacts (whole, campaign_id, "largest_N");
CREATE INDEX campaigns_device ON campaigns (device);
CREATE TRIGGER contact_points_kept_update before update on contact_points begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER contact_points_kept_delete before delete on contact_points begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER audit_follow before insert on audit when new.id is not (select coalesce(max(id), 0) + 1 from audit) or new.previous is not coalesce((select sha256 from audit order by id desc limit 1), '0000000000000000000000000000000000000000000000000000000000000000') begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER cells_follow before insert on cells when new.id is not (select coalesce(max(id), 0) + 1 from cells) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER campaigns_follow before insert on campaigns when new.id is not (select coalesce(max(id), 0) + 1 from campaigns) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER facts_follow before insert on facts when new.id is not (select coalesce(max(id), 0) + 1 from facts) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER recordings_follow before insert on recordings when new.id is not (select coalesce(max(id), 0) + 1 from recordings) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER impacts_follow before insert on impacts when new.id is not (select coalesce(max(id), 0) + 1 from impacts) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER uses_follow before insert on uses when new.id is not (select coalesce(max(id), 0) + 1 from uses) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER maps_follow before insert on maps when new.id is not (select coalesce(max(id), 0) + 1 from maps) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER contact_points_follow before insert on contact_points when new.id is not (select coalesce(max(id), 0) + 1 from contact_points) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER releases_follow before insert on releases when new.id is not (select coalesce(max(id), 0) + 1 from releases) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
CREATE TRIGGER withdrawals_follow before insert on withdrawals when new.id is not (select coalesce(max(id), 0) + 1 from withdrawals) or new.entry is not (select max(id) from audit) begin select raise(abort, 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'); end;
COMMIT;
